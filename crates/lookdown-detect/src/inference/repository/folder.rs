//! The folder of the models.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use super::error::RepositoryError;
use crate::inference::manifest::{FILE_NAME, ModelManifest, is_name};

/// Most entries of the folder that are read for a listing.
const MAX_ENTRIES: usize = 1000;
/// Most characters of a name that an error message repeats.
const MAX_NAME_CHARS: usize = 64;

/// A folder with one subfolder per model, named like the model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelFolder {
    /// The folder.
    pub path: PathBuf,
    /// Name and path of a model outside the folder: a folder or an ONNX file.
    pub elsewhere: Option<(String, PathBuf)>,
}

impl ModelFolder {
    /// Returns the path of the model with that name.
    pub(super) fn find(&self, name: &str) -> Result<PathBuf, RepositoryError> {
        match &self.elsewhere {
            Some((there, path)) if there == name => return Ok(path.clone()),
            _ => {}
        }
        let path = self.path.join(name);
        if is_name(name) && path.join(FILE_NAME).is_file() {
            return Ok(path);
        }
        Err(RepositoryError::Unknown {
            name: name.chars().take(MAX_NAME_CHARS).collect(),
            known: self.names().join(", "),
        })
    }

    /// The names of all models, sorted.
    pub(super) fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.path).into_iter().flatten();
        let folders = entries.take(MAX_ENTRIES).flatten().filter_map(|entry| {
            let name = entry.file_name().into_string().ok()?;
            (is_name(&name) && entry.path().join(FILE_NAME).is_file()).then_some(name)
        });
        let elsewhere = self.elsewhere.iter().map(|(name, _)| name.clone());
        let names: BTreeSet<_> = folders.chain(elsewhere).collect();
        names.into_iter().collect()
    }
}

/// Returns the names of the models in a folder, sorted.
pub fn model_names(folder: &Path) -> Vec<String> {
    let folder = ModelFolder {
        path: folder.to_owned(),
        elsewhere: None,
    };
    folder.names()
}

/// Returns true if a model's ONNX file exists. Weights are fetched, manifests are not.
pub fn is_fetched(model: &Path) -> bool {
    ModelManifest::locate(model).is_ok_and(|manifest| manifest.onnx.is_file())
}

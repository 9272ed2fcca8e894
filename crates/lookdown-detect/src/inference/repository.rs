//! The model repository: models in a folder that are loaded by name, and reloaded when their files
//! change.
//!
//! A model is put into service only after it was loaded, checked and run once. If that fails, the
//! previous model stays in service.

use std::{
    collections::{BTreeMap, BTreeSet},
    num::NonZeroUsize,
    path::{Path, PathBuf},
    sync::Arc,
};

use parking_lot::{Mutex, MutexGuard};

use super::{
    error::InferenceError,
    manifest::{FILE_NAME, is_name},
    model::{Model, ModelFiles, ModelRegistry, RegistryFull, Stamp, files_of, stamp},
    remote::RemoteServer,
};
use crate::metrics::{DetectMetrics, replace_info, start_at_zero};

/// Loads a model from its folder or ONNX file.
pub type ModelLoader = Box<dyn Fn(&Path) -> Result<Model, InferenceError> + Send + Sync>;

/// Options of the repository.
#[derive(Debug, Clone)]
pub struct RepositoryOptions {
    /// Folder of the models.
    pub folder: ModelFolder,
    /// Number of blank views in the warm-up of a model.
    pub warm_up_views: NonZeroUsize,
    /// Describes the error of a load to the users of the program: the text of the error, and what
    /// the engine does not know, such as the setting to change.
    pub explain: fn(&InferenceError) -> String,
}

/// The models of a folder, loaded or not.
pub struct ModelRepository {
    options: RepositoryOptions,
    /// The loaded models.
    pub registry: Arc<ModelRegistry>,
    loader: ModelLoader,
    /// The server on which the networks run, or `None` if they run locally.
    pub remote: Option<Arc<RemoteServer>>,
    /// Locked while a model is loaded, so that only one is loaded at a time.
    // After a panic the maps contain only complete entries.
    memory: Mutex<Memory>,
    metrics: Arc<DetectMetrics>,
}

/// State of models in addition to the loaded ones.
#[derive(Default)]
struct Memory {
    /// State of changed files at the last check.
    changed: BTreeMap<String, Stamp>,
    /// State of files that failed to load and are not tried again.
    refused: BTreeMap<String, Stamp>,
}

impl ModelRepository {
    /// A repository with these options, without any loaded model.
    pub fn new(
        options: RepositoryOptions,
        loader: ModelLoader,
        metrics: Arc<DetectMetrics>,
    ) -> Self {
        start_at_zero(&metrics.model_loads, &["success", "failure"]);
        Self {
            options,
            registry: Arc::default(),
            loader,
            remote: None,
            memory: Mutex::default(),
            metrics,
        }
    }

    /// Sets the server on which the networks run.
    pub fn on(self, remote: Arc<RemoteServer>) -> Self {
        Self {
            remote: Some(remote),
            ..self
        }
    }

    /// Returns false while the inference server is unavailable.
    pub fn is_remote_available(&self) -> bool {
        self.remote
            .as_ref()
            .is_none_or(|remote| remote.is_available())
    }

    /// Loads or reloads the model with that name. Blocks.
    ///
    /// # Errors
    /// [`RepositoryError`] when there is no such model, it fails its check, the number of models is
    /// at its limit, or another model is being loaded.
    pub fn load(&self, name: &str) -> Result<Arc<Model>, RepositoryError> {
        let mut memory = self.try_lock()?;
        let path = self.options.folder.find(name)?;
        self.replace(&mut memory, name, &path)
    }

    /// Returns true while a model is being loaded or checked.
    pub fn is_loading(&self) -> bool {
        self.try_lock().is_err()
    }

    /// Reloads the models whose files have changed. Files must be unchanged between two checks, so
    /// that no file is read while it is written. A model that failed is tried again only after its
    /// files change.
    pub fn reload_changed(&self) {
        if !self.is_remote_available() {
            return;
        }
        let mut memory = self.memory.lock();
        for model in self.registry.all() {
            let Some(files) = &model.files else { continue };
            let name = &model.name;
            let found = stamp(&files_of(&files.path));
            let is_changed =
                found.is_some() && found != files.stamp && memory.refused.get(name) != Some(&found);
            if !is_changed {
                memory.changed.remove(name);
            } else if memory.changed.get(name) == Some(&found) {
                memory.changed.remove(name);
                // The error is already logged.
                let _ = self.replace(&mut memory, name, &files.path);
            } else {
                memory.changed.insert(name.clone(), found);
            }
        }
    }

    /// Loads, checks and warms up a model, then replaces the previous one.
    fn replace(
        &self,
        memory: &mut Memory,
        name: &str,
        path: &Path,
    ) -> Result<Arc<Model>, RepositoryError> {
        // Taken before reading, so that a file that changes during the read is read again.
        let stamp = stamp(&files_of(path));
        let outcome = self.checked(name, path, &stamp).and_then(|model| {
            let model = Arc::new(model);
            let replaced = self.registry.put(Arc::clone(&model))?;
            Ok((model, replaced))
        });
        match outcome {
            Ok((model, replaced)) => {
                self.count_load("success");
                memory.refused.remove(name);
                let replaced = replaced.as_ref().map(|replaced| &*replaced.revision);
                let before = replaced.map(|revision| [name, revision]);
                replace_info(
                    &self.metrics.model_info,
                    before.as_ref().map(<[_; 2]>::as_slice),
                    &[name, &model.revision],
                );
                tracing::info!(model = name, revision = model.revision, replaced, "loaded");
                Ok(model)
            }
            Err(error) => {
                self.count_load("failure");
                if error.is_of_model() {
                    memory.refused.insert(name.to_owned(), stamp);
                }
                tracing::error!(model = name, "not loaded: {error}");
                Err(error)
            }
        }
    }

    fn checked(&self, name: &str, path: &Path, stamp: &Stamp) -> Result<Model, RepositoryError> {
        let refused = |cause| RepositoryError::Refused {
            text: (self.options.explain)(&cause),
            cause,
        };
        let mut model = (self.loader)(path).map_err(refused)?;
        if model.name != name {
            return Err(RepositoryError::OtherName {
                name: name.to_owned(),
                found: model.name.clone(),
                path: path.to_owned(),
            });
        }
        model.files = Some(ModelFiles {
            path: path.to_owned(),
            stamp: stamp.clone(),
        });
        model.warm_up(self.options.warm_up_views).map_err(refused)?;
        Ok(model)
    }

    fn count_load(&self, result: &str) {
        let loads = &self.metrics.model_loads;
        loads.with_label_values(&[result]).inc();
    }

    /// Locks the state, or returns [`RepositoryError::Busy`] while a model is being loaded.
    fn try_lock(&self) -> Result<MutexGuard<'_, Memory>, RepositoryError> {
        self.memory.try_lock().ok_or(RepositoryError::Busy)
    }
}

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

/// A model that was not loaded. Every message is one sentence that includes the remedy.
#[derive(Debug, thiserror::Error)]
pub enum RepositoryError {
    /// There is no such model.
    #[error("model: there is no {name:?} in the repository; there are {known}")]
    Unknown {
        /// The requested name.
        name: String,
        /// The available names.
        known: String,
    },
    /// The manifest's name differs from its folder's.
    #[error(
        "model: {path} has the name {found:?}: rename it to {name:?} like its folder or rename \
         the folder"
    )]
    OtherName {
        /// The requested name.
        name: String,
        /// The name in the manifest.
        found: String,
        /// Path of the model.
        path: PathBuf,
    },
    /// One model is loaded at a time.
    #[error("another model is being loaded: try again in a second")]
    Busy,
    /// The largest number of models is loaded.
    #[error(transparent)]
    Full(#[from] RegistryFull),
    /// It cannot be read, failed its check, or failed to run.
    #[error("{text}")]
    Refused {
        /// The cause.
        cause: InferenceError,
        /// The cause as [`RepositoryOptions::explain`] describes it.
        ///
        /// [`RepositoryOptions::explain`]: super::RepositoryOptions::explain
        text: String,
    },
}

impl RepositoryError {
    /// Returns true if a retry after a short time may succeed without a change.
    pub fn is_passing(&self) -> bool {
        matches!(
            self,
            Self::Busy
                | Self::Refused {
                    cause: InferenceError::Remote { .. } | InferenceError::RemoteBusy { .. },
                    ..
                }
        )
    }

    /// Returns true if the error is caused by the model itself, so that it persists until the files
    /// change.
    pub fn is_of_model(&self) -> bool {
        let is_denied = matches!(
            self,
            Self::Refused {
                cause: InferenceError::RemoteDenied { .. },
                ..
            }
        );
        !self.is_passing() && !is_denied
    }
}

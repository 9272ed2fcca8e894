//! Finding the files that settings name, and those at their default places.

use std::path::{Path, PathBuf};

use super::{InferenceSettings, ModelSettings, SettingsError};

/// Default folder of calibration files.
pub(super) const DEFAULT_CALIBRATIONS: &str = "calibrations";
/// Default folder of models.
pub(super) const DEFAULT_REPOSITORY: &str = "models";
/// Default ONNX Runtime library, where `make setup` puts it.
pub(super) const DEFAULT_LIBRARY: &str = "runtime/libonnxruntime.so";

/// The folder of calibrations; `None` when none is set and there is none at the default place.
///
/// # Errors
/// [`SettingsError::Missing`] when one is set that is not there.
pub fn find_calibrations(folder: &Path) -> Result<Option<PathBuf>, SettingsError> {
    let found = locate(folder, DEFAULT_CALIBRATIONS);
    if found.is_none() && folder != Path::new(DEFAULT_CALIBRATIONS) {
        return Err(SettingsError::Missing {
            key: "calibrations.path",
            what: "folder",
            path: folder.to_owned(),
            remedy: "create it, or set LOOKDOWN__CALIBRATIONS__PATH to another".to_owned(),
        });
    }
    Ok(found)
}

impl ModelSettings {
    /// The folder or file of the one model for all profiles, when one is set.
    ///
    /// # Errors
    /// [`SettingsError::Missing`] when it is not there.
    pub fn find_one(&self) -> Result<Option<PathBuf>, SettingsError> {
        match &self.path {
            Some(path) if !path.exists() => Err(SettingsError::Missing {
                key: "model.path",
                what: "model",
                path: path.clone(),
                remedy: "set LOOKDOWN__MODEL__PATH to a model folder, or leave it out".to_owned(),
            }),
            path => Ok(path.clone()),
        }
    }

    /// The folder of models. May be missing at its default place when there is one model for all
    /// profiles.
    ///
    /// # Errors
    /// [`SettingsError::Missing`] when it is not there.
    pub fn find_repository(&self) -> Result<PathBuf, SettingsError> {
        let is_default = self.repository == Path::new(DEFAULT_REPOSITORY);
        match locate(&self.repository, DEFAULT_REPOSITORY) {
            Some(found) => Ok(found),
            None if is_default && self.path.is_some() => Ok(self.repository.clone()),
            None => Err(SettingsError::Missing {
                key: "model.repository",
                what: "folder of models",
                path: self.repository.clone(),
                remedy: "run `make setup`, or set LOOKDOWN__MODEL__REPOSITORY to another"
                    .to_owned(),
            }),
        }
    }
}

impl InferenceSettings {
    /// The ONNX Runtime library.
    ///
    /// # Errors
    /// [`SettingsError::Missing`] when it is not there.
    pub fn find_library(&self) -> Result<PathBuf, SettingsError> {
        locate(&self.library_path, DEFAULT_LIBRARY).ok_or_else(|| SettingsError::Missing {
            key: "inference.library_path",
            what: "ONNX Runtime library",
            path: self.library_path.clone(),
            remedy: "run `make setup`, or set LOOKDOWN__INFERENCE__LIBRARY_PATH to \
                     libonnxruntime.so"
                .to_owned(),
        })
    }
}

/// The existing file or folder at `path` in the current directory, or else beside the executable or
/// in the folders above it.
#[must_use]
pub fn find_beside_executable(path: &Path) -> Option<PathBuf> {
    if path.exists() {
        return Some(path.to_owned());
    }
    let executable = std::env::current_exe().ok()?;
    let mut candidates = executable.ancestors().skip(1).map(|above| above.join(path));
    candidates.find(|candidate| candidate.exists())
}

/// The existing file or folder that `path` means.
///
/// A path that is set is taken as it is. The default one is looked for in the current directory
/// and then beside the executable and in the folders above it, so that
/// `/anywhere/lookdown/target/release/lookdown` finds what belongs to it from any current directory.
fn locate(path: &Path, default: &str) -> Option<PathBuf> {
    if path == Path::new(default) {
        return find_beside_executable(path);
    }
    path.exists().then(|| path.to_owned())
}

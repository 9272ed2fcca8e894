//! The models.

use std::{
    num::NonZeroU64,
    path::{Path, PathBuf},
};

use super::{
    SettingsError,
    declare::settings,
    form::{names, optional, path, poll_seconds},
    locate::{DEFAULT_REPOSITORY, locate},
};

settings! {
    /// The models.
    #[derive(Debug, Clone, PartialEq)]
    pub struct ModelSettings in "model" {
        /// One model for all profiles: a model folder or an ONNX file. Empty: each profile has its
        /// own.
        path: Option<PathBuf> = None => optional(path());
        /// The folder of models, each in a folder of its name. The default folder is
        /// searched for beside the executable, in the repository that it was built in, and in
        /// `/usr/lib/lookdown`, never in the current folder.
        repository: PathBuf = DEFAULT_REPOSITORY.into() => path();
        /// Names of models to load at the start in addition to those of the profiles.
        also_load: Vec<String> = Vec::new() => names();
        /// The interval in seconds at which the files of loaded models are checked for changes. 0:
        /// never. A changed model is used once it has passed its check.
        poll_seconds: Option<NonZeroU64> = NonZeroU64::new(5) => poll_seconds();
    }
}

impl ModelSettings {
    /// Returns the folder or file of the single model for all profiles, if it is set.
    ///
    /// # Errors
    /// [`SettingsError::Missing`] when it does not exist.
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

    /// Returns the folder of models. The default folder may be missing if there is a single model
    /// for all profiles.
    ///
    /// # Errors
    /// [`SettingsError::Missing`] when it does not exist.
    pub fn find_repository(&self) -> Result<PathBuf, SettingsError> {
        let is_default = self.repository == Path::new(DEFAULT_REPOSITORY);
        match locate(&self.repository, DEFAULT_REPOSITORY) {
            Some(found) => Ok(found),
            None if is_default && self.path.is_some() => Ok(self.repository.clone()),
            None => Err(SettingsError::Missing {
                key: "model.repository",
                what: "folder of models",
                path: self.repository.clone(),
                remedy: "set LOOKDOWN__MODEL__REPOSITORY to the folder `models` of the repository"
                    .to_owned(),
            }),
        }
    }
}

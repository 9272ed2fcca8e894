//! Errors of loading models.

use std::path::PathBuf;

use crate::inference::{error::InferenceError, registry::RegistryFull};

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

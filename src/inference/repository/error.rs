//! Why a model could not be loaded or unloaded.

use std::path::PathBuf;

use crate::inference::{InferenceError, RegistryFull};

/// A model that was not loaded or unloaded. Every message is one sentence with the remedy.
#[derive(Debug, thiserror::Error)]
pub enum RepositoryError {
    /// There is no such model.
    #[error("model: there is no {name:?} in the repository; there are {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// The model is not loaded.
    #[error("model: {name:?} is not loaded")]
    NotLoaded {
        /// The name asked for.
        name: String,
    },
    /// Requests that name no model rely on it.
    #[error("model: {name:?} answers requests that name no model, so it is not unloaded")]
    Kept {
        /// The model.
        name: String,
    },
    /// The manifest has another name than its folder.
    #[error("model: {path} calls itself {found:?}; name it {name:?} as its folder, or rename that")]
    OtherName {
        /// The name asked for.
        name: String,
        /// The name it gives itself.
        found: String,
        /// Where it is.
        path: PathBuf,
    },
    /// One model is loaded at a time.
    #[error("another model is being loaded: try again in a second")]
    Busy,
    /// There is no room.
    #[error(transparent)]
    Full(#[from] RegistryFull),
    /// It cannot be read, failed its check, or failed to run.
    #[error(transparent)]
    Refused(#[from] InferenceError),
}

impl RepositoryError {
    /// Whether the model may be loaded in a moment, without anybody doing something.
    #[must_use]
    pub fn is_passing(&self) -> bool {
        matches!(
            self,
            Self::Busy
                | Self::Refused(InferenceError::Remote { .. } | InferenceError::RemoteBusy { .. })
        )
    }

    /// Whether it says something of the model: then nothing changes until its files do.
    #[must_use]
    pub fn is_of_model(&self) -> bool {
        !self.is_passing() && !matches!(self, Self::Refused(InferenceError::RemoteDenied { .. }))
    }
}

//! Why a calibration cannot be used.

use std::path::{Path, PathBuf};

use super::{FormatError, StoreError};

/// A calibration that cannot be used. Every message is one sentence with the remedy.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// The file or folder cannot be read.
    #[error("{path}: cannot be read: {source}")]
    Unreadable {
        /// Which file or folder.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// Its content cannot be used.
    #[error("{path}: {problem}")]
    Unusable {
        /// Which file.
        path: PathBuf,
        /// The field, its value and what would be right.
        problem: FormatError,
    },
    /// Its file in a store cannot be used.
    #[error("{place}: {problem}")]
    Stored {
        /// Which file.
        place: String,
        /// The field, its value and what would be right.
        problem: String,
    },
    /// The store cannot be looked at.
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl CalibrationError {
    /// What is wrong with the content of a file.
    pub(super) fn in_file(path: &Path, problem: FormatError) -> Self {
        Self::Unusable {
            path: path.to_owned(),
            problem,
        }
    }
}

//! Reasons for which a calibration cannot be used.

use std::path::{Path, PathBuf};

use super::FormatError;

/// A calibration that cannot be used. Every message is one sentence with the remedy.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// The file or folder cannot be read.
    #[error("{path}: cannot be read: {source}")]
    Unreadable {
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// Its content cannot be used.
    #[error("{path}: {problem}")]
    Unusable {
        /// The file.
        path: PathBuf,
        /// The field, its value and what would be right.
        problem: FormatError,
    },
}

impl CalibrationError {
    /// Creates the error for the content of a file.
    pub(super) fn in_file(path: &Path, problem: FormatError) -> Self {
        Self::Unusable {
            path: path.to_owned(),
            problem,
        }
    }
}

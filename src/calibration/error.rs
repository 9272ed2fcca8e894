//! Why a calibration cannot be used.

use std::path::{Path, PathBuf};

use super::{CalibrationId, FormatError};

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
    /// A file does not hold the camera that was asked for.
    #[error("{path}: it holds no camera {id}")]
    NotInFile {
        /// Which file.
        path: PathBuf,
        /// The camera.
        id: CalibrationId,
    },
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

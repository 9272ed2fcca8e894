//! Why a calibration cannot be used.

use std::path::PathBuf;

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
    /// The file is not what its ending promises.
    #[error("{path}: not a calibration file: {detail}")]
    Malformed {
        /// Which file.
        path: PathBuf,
        /// What the parser said, with the place.
        detail: String,
    },
    /// A field's value makes no camera.
    #[error("{path}: {field}: {problem}")]
    Invalid {
        /// Which file.
        path: PathBuf,
        /// Which field.
        field: &'static str,
        /// The value and what would be right.
        problem: String,
    },
}

//! The reasons why a camera cannot be stored, removed or read.

use std::{io, path::PathBuf};

use lookdown_common::ConfigError;
use lookdown_watch::SourceError;

/// A camera that cannot be stored or removed.
#[derive(Debug, thiserror::Error)]
pub enum CameraError {
    /// A value that cannot be used.
    #[error(transparent)]
    Invalid(#[from] ConfigError),
    /// A camera of the settings file.
    #[error("{0}: this camera is in the settings file: change it there")]
    Configured(String),
    /// The state folder cannot be used.
    #[error("state.path: {0} cannot be written: {1}")]
    Folder(PathBuf, #[source] io::Error),
    /// Other cameras are being tested.
    #[error("other cameras are being tested: retry")]
    Busy,
    /// The camera gives no frame.
    #[error(transparent)]
    Source(#[from] SourceError),
}

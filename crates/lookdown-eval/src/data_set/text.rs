//! Annotation files as text, with a size limit.

use std::path::Path;

use lookdown_common::files::{self, FileError};

/// Reads the text of a file of at most `max_bytes`.
pub(crate) fn read_text(path: &Path, max_bytes: u64) -> Result<String, FileError> {
    files::read_text(path, max_bytes).map_err(|error| FileError::unreadable(path, &error))
}

//! Annotation files as text, with a size limit.

use std::path::Path;

use lookdown_common::files;

use super::DataSetError;

/// Reads the text of a file of at most `max_bytes`.
pub(super) fn read_text(path: &Path, max_bytes: u64) -> Result<String, DataSetError> {
    let unreadable = |source| DataSetError::Unreadable {
        path: path.to_owned(),
        source,
    };
    files::read_text(path, max_bytes).map_err(unreadable)
}

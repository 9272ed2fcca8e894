//! Annotation files as text, with a size limit.

use std::path::Path;

use super::DataSetError;

/// Reads the text of a file of at most `max_bytes`.
pub(super) fn read_text(path: &Path, max_bytes: u64) -> Result<String, DataSetError> {
    let unreadable = |source| DataSetError::Unreadable {
        path: path.to_owned(),
        source,
    };
    let bytes = std::fs::metadata(path).map_err(unreadable)?.len();
    if bytes > max_bytes {
        return Err(DataSetError::Annotations {
            path: path.to_owned(),
            problem: format!("it has {bytes} bytes; at most {max_bytes} are read"),
        });
    }
    std::fs::read_to_string(path).map_err(unreadable)
}

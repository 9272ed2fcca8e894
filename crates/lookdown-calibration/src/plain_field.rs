//! The names of zones, lines and sites.

use lookdown_common::plain_name::{MAX_CHARS, is_plain};

use crate::FormatError;

/// Checks the name in a field of a calibration file.
pub(super) fn check_name(field: &str, name: &str) -> Result<(), FormatError> {
    if is_plain(name) {
        return Ok(());
    }
    let shown: String = name.chars().take(MAX_CHARS).collect();
    let problem = format!(
        "it is {shown:?}: use 1 to {MAX_CHARS} of a-z, 0-9, _ and -, beginning with a letter or \
         digit"
    );
    Err(FormatError::invalid(field, problem))
}

//! Text that is never shown.

use std::fmt;

use serde::Deserialize;

/// Text in which somebody may have written a secret.
#[derive(Clone, PartialEq, Default, Deserialize)]
pub(super) struct Unshown(pub(super) String);

impl fmt::Debug for Unshown {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("…")
    }
}

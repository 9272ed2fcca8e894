//! The key of a definition: the calibration and the frame size of a report.

use serde::{Deserialize, Serialize};

/// The calibration and the frame size that a definition belongs to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct DefinitionKey {
    /// The ID of the calibration; `None` without one.
    pub(crate) calibration: Option<String>,
    /// Its revision.
    pub(crate) revision: String,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

//! The calibrations that requests name by their IDs.

use std::sync::Arc;

use lookdown_calibration::{Calibration, CalibrationId};

/// Calibrations by their IDs. A lookup does not block.
pub trait CalibrationLookup: Send + Sync {
    /// Returns the calibration with this ID, or `None` if there is none.
    ///
    /// # Errors
    /// [`UnusableCalibration`] if there is one that cannot be used.
    fn get(&self, id: &CalibrationId) -> Result<Option<Arc<Calibration>>, UnusableCalibration>;
}

/// A calibration whose file has never held a usable one, or holds several.
#[derive(Debug, thiserror::Error)]
#[error("{place}: {problem}")]
pub struct UnusableCalibration {
    /// The file.
    pub place: String,
    /// The field, its value and what would be right.
    pub problem: String,
}

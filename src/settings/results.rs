//! What is kept of reports, as it is written and checked.

use serde::Deserialize;

use super::{
    SettingsError,
    check::{MAX_BYTES, count, size},
};
use crate::results::ResultLimits;

/// 8 MiB: any one report has room.
const MIN_BYTES: u64 = 8 << 20;

/// Table `results`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawResults {
    max_cameras: u64,
    history_per_camera: u64,
    max_reports: u64,
    max_bytes: u64,
    max_listeners: u64,
}

impl Default for RawResults {
    fn default() -> Self {
        let limits = ResultLimits::default();
        Self {
            max_cameras: limits.max_cameras.get() as u64,
            history_per_camera: limits.history_per_camera.get() as u64,
            max_reports: limits.max_reports.get() as u64,
            max_bytes: limits.max_bytes as u64,
            max_listeners: limits.max_listeners.get() as u64,
        }
    }
}

impl TryFrom<RawResults> for ResultLimits {
    type Error = SettingsError;

    fn try_from(raw: RawResults) -> Result<Self, SettingsError> {
        Ok(Self {
            max_cameras: count("results.max_cameras", raw.max_cameras)?,
            history_per_camera: count("results.history_per_camera", raw.history_per_camera)?,
            max_reports: count("results.max_reports", raw.max_reports)?,
            max_bytes: size("results.max_bytes", raw.max_bytes, MIN_BYTES..=MAX_BYTES)?,
            max_listeners: count("results.max_listeners", raw.max_listeners)?,
        })
    }
}

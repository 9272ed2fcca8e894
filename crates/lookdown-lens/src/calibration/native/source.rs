//! The source of a value of a calibration.

use serde::{Deserialize, Serialize};

/// Kind of source.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, strum::Display, strum::EnumString,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum ValueSource {
    /// Measured in frames, or with a tool.
    Measured,
    /// Given by the user, from a data sheet for example.
    Given,
    /// Assumed without a measurement.
    Assumed,
    /// Derived from the people in frames.
    FromPeople,
}

/// Source and uncertainty of a value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativeSource {
    /// Kind of source.
    pub source: ValueSource,
    /// Standard deviation: of `lens` in percent of the radius, of `center` in pixels, of `world_up`
    /// in degrees, of `height_m` in meters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<f64>,
}

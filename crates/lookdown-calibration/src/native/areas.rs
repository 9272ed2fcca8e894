//! Zones, lines, masks and places as they are written. Corners follow each other along the outline;
//! pixels are corner-origin, of frames of the calibration's own size.

use serde::{Deserialize, Serialize};

/// A named area, in pixels of the frame or in meters on the floor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativeZone {
    /// Its name, `[a-z0-9][a-z0-9_-]{0,63}`.
    pub name: String,
    /// Corners `[x, y]`, frame pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame_px: Option<Vec<[f64; 2]>>,
    /// Corners `[x, y]`, meters on the floor from the place below the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor_m: Option<Vec<[f64; 2]>>,
    /// `expected` for a bed, a sofa or a mat, where people who lie are no reason for a floor alert.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lying: Option<NativeLying>,
}

/// The meaning of people who lie in a zone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NativeLying {
    /// People may lie there.
    Expected,
}

/// A named line, in pixels of the frame or in meters on the floor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativeLine {
    /// Its name, `[a-z0-9][a-z0-9_-]{0,63}`.
    pub name: String,
    /// Its two ends `[x, y]`, frame pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame_px: Option<Vec<[f64; 2]>>,
    /// Its two ends `[x, y]`, meters on the floor from the place below the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor_m: Option<Vec<[f64; 2]>>,
    /// The names of the crossings from left to right and from right to left, as seen from the first
    /// end toward the second one.
    #[serde(default = "in_and_out", skip_serializing_if = "is_in_and_out")]
    pub directions: [String; 2],
}

fn in_and_out() -> [String; 2] {
    ["in", "out"].map(ToOwned::to_owned)
}

fn is_in_and_out(directions: &[String; 2]) -> bool {
    directions == &["in", "out"]
}

/// A place where people count or do not count, in pixels of the frame or in meters on the floor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativePlace {
    /// Its name, `[a-z0-9][a-z0-9_-]{0,63}`; only people read it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Corners `[x, y]`, frame pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame_px: Option<Vec<[f64; 2]>>,
    /// Corners `[x, y]`, meters on the floor from the place below the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor_m: Option<Vec<[f64; 2]>>,
}

/// An area that is blanked before anything looks at a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativeMask {
    /// Corners `[x, y]`, frame pixels.
    pub frame_px: Vec<[f64; 2]>,
}

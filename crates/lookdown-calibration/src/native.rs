//! The shape of the native calibration file, before its values are checked: what is read, and what
//! other formats are turned into. Writing one gives a file that reads back as the same camera.

mod areas;
mod detect;
mod source;

use std::{collections::BTreeMap, str::FromStr};

use lookdown_common::StoredFile;
use serde::{Deserialize, Serialize};

pub use areas::{NativeLine, NativeLying, NativeMask, NativePlace, NativeZone};
pub use detect::NativeValue;
pub use source::{NativeSource, SourcedValue, ValueSource};

use lookdown_lens::geometry::lens::LensModel;

/// A whole calibration file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativeCalibration {
    /// The version of the format; 1 if absent.
    #[serde(default = "first", skip_serializing_if = "is_first")]
    pub version: u8,
    /// The calibration's ID, `[a-z0-9][a-z0-9_-]{0,63}`.
    pub id: String,
    /// The size of the frames it was made for.
    pub image: NativeImage,
    /// The lens.
    pub lens: LensModel,
    /// The mount of the camera; straight down by default.
    #[serde(default)]
    pub mount: NativeMount,
    /// Areas that persons are counted in.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub zones: Vec<NativeZone>,
    /// Lines over which persons are counted.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<NativeLine>,
    /// Areas that are blanked before detection.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub masks: Vec<NativeMask>,
    /// The places where people can be; those outside of all are in no result.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub areas: Vec<NativePlace>,
    /// Places whose detections are in no result.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ignore: Vec<NativePlace>,
    /// Defaults of detection parameters for the frames of this camera, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub detect: BTreeMap<String, NativeValue>,
    /// The sources of values.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub sources: BTreeMap<SourcedValue, NativeSource>,
}

impl NativeCalibration {
    /// Creates the calibration of a camera that looks straight down, without areas and defaults.
    pub fn new(id: String, image: NativeImage, lens: LensModel) -> Self {
        Self {
            version: StoredFile::Calibration.version(),
            id,
            image,
            lens,
            mount: NativeMount::default(),
            zones: Vec::new(),
            lines: Vec::new(),
            masks: Vec::new(),
            areas: Vec::new(),
            ignore: Vec::new(),
            detect: BTreeMap::new(),
            sources: BTreeMap::new(),
        }
    }
}

/// The version of a file without one.
const FIRST: u8 = 1;

const fn first() -> u8 {
    FIRST
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "the shape serde needs")]
const fn is_first(version: &u8) -> bool {
    *version == FIRST
}

/// A frame size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativeImage {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

/// `640x480`
impl FromStr for NativeImage {
    type Err = NotAFrameSize;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let sides = text.split_once('x');
        let sides = sides.and_then(|(width, height)| {
            let (width, height) = (width.parse().ok()?, height.parse().ok()?);
            Some(Self { width, height })
        });
        sides.ok_or(NotAFrameSize)
    }
}

/// Text that is not a frame size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("give the width and height in pixels, such as 640x480")]
pub struct NotAFrameSize;

/// The mount of the camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativeMount {
    /// The direction of up in the camera frame, a unit vector.
    pub world_up: [f64; 3],
    /// Meters above the floor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// The name of the site whose floor several cameras share.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub site: Option<String>,
    /// The floor point below the camera, in meters of the site.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_m: Option<[f64; 2]>,
    /// The angle from the x axis of the site to that of the camera's floor, in degrees from x to y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yaw_deg: Option<f64>,
}

impl Default for NativeMount {
    fn default() -> Self {
        Self {
            world_up: [0.0, 0.0, -1.0],
            height_m: None,
            site: None,
            position_m: None,
            yaw_deg: None,
        }
    }
}

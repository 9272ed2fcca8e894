//! The shape of the native calibration file, before its values are checked: what is read, and what
//! other formats are turned into. Writing one gives a file that reads back as the same camera.
//!
//! Values of detection parameters in a calibration. The lens library does not know the parameters:
//! their names and values are checked by the program that reads the calibration.
//!
//! Zones, lines, masks and places as they are written. Corners follow each other along the outline;
//! pixels are corner-origin, of frames of the calibration's own size.

use std::{collections::BTreeMap, fmt, str::FromStr};

use lookdown_common::StoredFile;
use lookdown_lens::geometry::lens::LensModel;
use serde::{Deserialize, Deserializer, Serialize, de::Error};

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

/// The value of a parameter as it is written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum NativeValue {
    /// `true` or `false`.
    Switch(bool),
    /// A whole number.
    Whole(i64),
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
}

/// Writes the value as a request would give it.
impl fmt::Display for NativeValue {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Switch(value) => value.fmt(formatter),
            Self::Whole(value) => value.fmt(formatter),
            Self::Number(value) => value.fmt(formatter),
            Self::Text(value) => value.fmt(formatter),
        }
    }
}

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

/// The values of a calibration that have a source.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, strum::Display,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum SourcedValue {
    /// The radius at all angles.
    Lens,
    /// The projection of the lens, if it has another source.
    LensModel,
    /// The angle at the circle, if it has another source.
    FieldOfView,
    /// The optical center.
    Center,
    /// The direction of up.
    WorldUp,
    /// The height above the floor.
    HeightM,
    /// The floor point below the camera on the floor of its site.
    PositionM,
    /// The rotation on the floor of its site.
    YawDeg,
}

impl SourcedValue {
    /// Returns true for a value of the lens or of the level, which a fit to frames finds together.
    pub fn is_of_lens_or_level(self) -> bool {
        match self {
            Self::Lens | Self::LensModel | Self::FieldOfView | Self::Center | Self::WorldUp => true,
            Self::HeightM | Self::PositionM | Self::YawDeg => false,
        }
    }

    /// Returns the unit of the standard deviation, to follow its number.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Lens => " % of the radius",
            Self::LensModel => "",
            Self::FieldOfView | Self::WorldUp | Self::YawDeg => "°",
            Self::Center => " pixels",
            Self::HeightM | Self::PositionM => " m",
        }
    }
}

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
    /// Standard deviation in the unit of [`SourcedValue::unit`]: finite and not negative.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deviation"
    )]
    pub uncertainty: Option<f64>,
}

impl NativeSource {
    /// A value of the user.
    pub const GIVEN: Self = Self::without_deviation(ValueSource::Given);
    /// A value without a measurement.
    pub const ASSUMED: Self = Self::without_deviation(ValueSource::Assumed);

    const fn without_deviation(source: ValueSource) -> Self {
        Self {
            source,
            uncertainty: None,
        }
    }

    /// A measured value with its standard deviation, if that is known.
    pub fn measured(uncertainty: Option<f64>) -> Self {
        Self {
            source: ValueSource::Measured,
            uncertainty,
        }
    }

    /// A value from people with its standard deviation.
    pub fn from_people(uncertainty: f64) -> Self {
        Self {
            source: ValueSource::FromPeople,
            uncertainty: Some(uncertainty),
        }
    }
}

fn deviation<'de, D: Deserializer<'de>>(input: D) -> Result<Option<f64>, D::Error> {
    let value = Option::<f64>::deserialize(input)?;
    match value {
        Some(value) if !(value.is_finite() && value >= 0.0) => Err(D::Error::custom(format!(
            "uncertainty is {value}: give a standard deviation of 0 or more"
        ))),
        _ => Ok(value),
    }
}

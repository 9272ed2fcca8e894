//! The shape of the native calibration file, before its values are checked: what is read, and what
//! other formats are turned into. Writing one gives a file that reads back as the same camera.

mod areas;
mod read_lens;

use std::str::FromStr;

use serde::{Deserialize, Serialize};

pub use areas::{NativeMask, NativeZone};

/// A whole calibration file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativeCalibration {
    /// The calibration's ID, `[a-z0-9][a-z0-9_-]{0,63}`.
    pub id: String,
    /// The size of the frames it was made for.
    pub image: NativeImage,
    /// The lens.
    pub lens: NativeLens,
    /// How the camera hangs; straight down unless said otherwise.
    #[serde(default)]
    pub mount: NativeMount,
    /// Areas that persons are counted in.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub zones: Vec<NativeZone>,
    /// Areas that nobody looks at.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub masks: Vec<NativeMask>,
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

/// Text that is no frame size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("give the width and height in pixels, such as 640x480")]
pub struct NotAFrameSize;

/// How the camera hangs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativeMount {
    /// The direction of up in the camera frame, a unit vector.
    pub world_up: [f64; 3],
    /// Metres above the floor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
}

impl Default for NativeMount {
    fn default() -> Self {
        Self {
            world_up: [0.0, 0.0, -1.0],
            height_m: None,
        }
    }
}

/// A lens: its model and the parameters of that model. `cx`, `cy` are pixel centres, angles
/// radians; formulas and sources are with [`crate::geometry::lens::LensModel`].
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "model", rename_all = "snake_case")]
pub enum NativeLens {
    /// `r = theta`.
    Equidistant(NativeIdeal),
    /// `r = 2 sin(theta / 2)`.
    Equisolid(NativeIdeal),
    /// `r = 2 tan(theta / 2)`.
    Stereographic(NativeIdeal),
    /// `r = sin(theta)`.
    Orthographic(NativeIdeal),
    /// `r = tan(theta)`.
    Rectilinear(NativeIdeal),
    /// A polynomial of the angle, in pixels.
    RadialPolynomial(NativeRadialPolynomial),
    /// Kannala and Brandt, also known as OpenCV fisheye.
    KannalaBrandt(NativeKannalaBrandt),
    /// Unified camera model.
    Ucm(NativeUcm),
    /// Enhanced unified camera model.
    Eucm(NativeEucm),
    /// Mei, also known as omnidirectional with radial and tangential distortion.
    Mei(NativeMei),
    /// Double sphere.
    DoubleSphere(NativeDoubleSphere),
    /// Scaramuzza's polynomial, as `OCamCalib` writes it.
    Ocam(NativeOcam),
    /// Devernay and Faugeras.
    Fov(NativeFov),
    /// NVIDIA's f-theta.
    FTheta(NativeFTheta),
}

/// Parameters of the ideal projections: `focal`, or `fx` and `fy`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    missing_docs,
    reason = "the terms of the field, formulas are in docs/geometry.md"
)]
pub struct NativeIdeal {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fx: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fy: Option<f64>,
    pub cx: f64,
    pub cy: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_theta: Option<f64>,
}

/// Parameters of `radial_polynomial`: the radius in pixels is `c0 + c1 theta + …`, and `aspect` is
/// the height of a pixel's step over its width.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    missing_docs,
    reason = "the terms of the field, formulas are in docs/geometry.md"
)]
pub struct NativeRadialPolynomial {
    pub coefficients: Vec<f64>,
    #[serde(default = "one")]
    pub aspect: f64,
    pub cx: f64,
    pub cy: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_theta: Option<f64>,
}

/// Parameters of `kannala_brandt`; `skew` is in pixels (`fx · alpha` of OpenCV's fisheye module).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    missing_docs,
    reason = "the terms of the field, formulas are in docs/geometry.md"
)]
pub struct NativeKannalaBrandt {
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    pub k: [f64; 4],
    #[serde(default)]
    pub skew: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_theta: Option<f64>,
}

/// Parameters of `ucm`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    missing_docs,
    reason = "the terms of the field, formulas are in docs/geometry.md"
)]
pub struct NativeUcm {
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    pub alpha: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_theta: Option<f64>,
}

/// Parameters of `eucm`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    missing_docs,
    reason = "the terms of the field, formulas are in docs/geometry.md"
)]
pub struct NativeEucm {
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    pub alpha: f64,
    pub beta: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_theta: Option<f64>,
}

/// Parameters of `mei`; `skew` is in pixels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    missing_docs,
    reason = "the terms of the field, formulas are in docs/geometry.md"
)]
pub struct NativeMei {
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    pub xi: f64,
    pub k1: f64,
    pub k2: f64,
    pub p1: f64,
    pub p2: f64,
    #[serde(default)]
    pub skew: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_theta: Option<f64>,
}

/// Parameters of `double_sphere`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    missing_docs,
    reason = "the terms of the field, formulas are in docs/geometry.md"
)]
pub struct NativeDoubleSphere {
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    pub xi: f64,
    pub alpha: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_theta: Option<f64>,
}

/// Parameters of `ocam`. `polynomial` is the direct one with `OCamCalib`'s signs (its first
/// coefficient is negative); `cx` is the column and `cy` the row of the centre, counted from 0;
/// `row = c · y + d · x + cy`, `column = e · y + x + cx`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    missing_docs,
    reason = "the terms of the field, formulas are in docs/geometry.md"
)]
pub struct NativeOcam {
    pub polynomial: Vec<f64>,
    #[serde(default = "one")]
    pub c: f64,
    #[serde(default)]
    pub d: f64,
    #[serde(default)]
    pub e: f64,
    pub cx: f64,
    pub cy: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_theta: Option<f64>,
}

/// Parameters of `fov`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    missing_docs,
    reason = "the terms of the field, formulas are in docs/geometry.md"
)]
pub struct NativeFov {
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    pub omega: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_theta: Option<f64>,
}

/// Parameters of `f_theta`: one of the two polynomials, the one the calibration declares as its
/// reference. `u = c · x + d · y + cx`, `v = e · x + y + cy`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    missing_docs,
    reason = "the terms of the field, formulas are in docs/geometry.md"
)]
pub struct NativeFTheta {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_to_pixel: Option<[f64; 6]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixel_to_angle: Option<[f64; 6]>,
    #[serde(default = "one")]
    pub c: f64,
    #[serde(default)]
    pub d: f64,
    #[serde(default)]
    pub e: f64,
    pub cx: f64,
    pub cy: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_theta: Option<f64>,
}

fn one() -> f64 {
    1.0
}

//! Scaramuzza's polynomial, as `OCamCalib` writes it.

use crate::geometry::lens::{
    ImagePlane, LensError,
    check::{finite, in_range, positive},
    curve::FittedCurve,
    model::Model,
    polynomial::{Polynomial, Rising},
};

/// The radius up to which the angle may rise, in units of the focal length: the corner of a
/// frame is never that far out.
const REACH: f64 = 16.0;

lens_parameters! {
    /// The angle is that of the vector (`r`, `−(a0 + a1 r + a2 r² + …)`), `r` in pixels. Valid
    /// while the angle rises, up to a radius of 16 `|a0|`. Scaramuzza, Martinelli and Siegwart
    /// 2006, with `OCamCalib`'s signs. `column = e · y + x + cx`, `row = c · y + d · x + cy`,
    /// counted from 0.
    pub struct Ocam: Centered {
        /// The direct polynomial, `a0 … an`; `a0` is negative.
        pub polynomial: Vec<f64>,
        /// Stretch of the rows.
        #[serde(default = "crate::geometry::lens::model::one")]
        pub c: f64,
        /// Shift of the row per unit of `x`.
        #[serde(default)]
        pub d: f64,
        /// Shift of the column per unit of `y`.
        #[serde(default)]
        pub e: f64,
    }
}

impl Ocam {
    /// Creates the lens with this polynomial and center and with square pixels.
    pub fn new(polynomial: Vec<f64>, [cx, cy]: [f64; 2]) -> Self {
        Self {
            polynomial,
            c: 1.0,
            d: 0.0,
            e: 0.0,
            cx,
            cy,
            max_theta: None,
        }
    }

    pub(super) fn plane(&self) -> Result<ImagePlane, LensError> {
        Ok(ImagePlane {
            skew: finite("e", self.e)?,
            row_skew: finite("d", self.d)?,
            ..ImagePlane::new(1.0, positive("c", self.c)?, self.cx, self.cy)
        })
    }
}

impl Model for Ocam {
    type Curve = FittedCurve<OcamAngle>;

    fn curve(&self) -> Result<Self::Curve, LensError> {
        let angle = OcamAngle(Polynomial::checked("polynomial", &self.polynomial, 1)?);
        let range = "below 0; OCamCalib's z axis points into the camera";
        let first = (Self::NAME, "polynomial[0]");
        let first = in_range(first, self.polynomial[0], |first| first < 0.0, range)?;
        // At the axis there are `-first` pixels per radian.
        Ok(FittedCurve::angle_up_to(REACH * -first, angle))
    }
}

/// The angle of the vector (`r`, `−p(r)`) from the optical axis.
#[derive(Debug, Clone, PartialEq)]
pub struct OcamAngle(Polynomial);

impl Rising for OcamAngle {
    fn value(&self, radius: f64) -> f64 {
        radius.atan2(-self.0.value(radius))
    }

    fn slope(&self, radius: f64) -> f64 {
        let depth = self.0.value(radius);
        (radius * self.0.slope(radius) - depth) / (radius * radius + depth * depth)
    }
}

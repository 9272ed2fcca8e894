//! NVIDIA's f-theta camera.

use crate::geometry::lens::{
    ImagePlane, LensError,
    check::{finite, positive},
    curve::{AngleCurve, Curve, RadiusCurve},
    model::Model,
    polynomial::Polynomial,
};

lens_parameters! {
    /// The radius in pixels is a polynomial of the angle, or the angle one of the radius: the
    /// calibration declares one of the two as its reference. Valid while the polynomial rises.
    /// `u = c · x + d · y + cx`, `v = e · x + y + cy`.
    pub struct FTheta: Centered {
        /// From radians to pixels, lowest power first; the constant is 0.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub angle_to_pixel: Option<[f64; 6]>,
        /// From pixels to radians, lowest power first; the constant is 0.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub pixel_to_angle: Option<[f64; 6]>,
        /// Stretch of the columns.
        #[serde(default = "crate::geometry::lens::model::one")]
        pub c: f64,
        /// Shift of the column per unit of `y`.
        #[serde(default)]
        pub d: f64,
        /// Shift of the row per unit of `x`.
        #[serde(default)]
        pub e: f64,
    }
}

impl FTheta {
    pub(super) fn plane(&self) -> Result<ImagePlane, LensError> {
        Ok(ImagePlane {
            skew: finite("d", self.d)?,
            row_skew: finite("e", self.e)?,
            ..ImagePlane::new(positive("c", self.c)?, 1.0, self.cx, self.cy)
        })
    }
}

impl Model for FTheta {
    type Curve = FThetaCurve;

    fn curve(&self) -> Result<FThetaCurve, LensError> {
        match (&self.angle_to_pixel, &self.pixel_to_angle) {
            (Some(coefficients), None) => {
                let polynomial = Polynomial::from_axis("angle_to_pixel", coefficients)?;
                Ok(FThetaCurve::Radius(RadiusCurve::new(polynomial)))
            }
            (None, Some(coefficients)) => {
                let polynomial = Polynomial::from_axis("pixel_to_angle", coefficients)?;
                Ok(FThetaCurve::Angle(AngleCurve::new(polynomial)))
            }
            _ => Err(LensError::EitherOr {
                choice: "angle_to_pixel or pixel_to_angle, the one that is exact",
            }),
        }
    }
}

/// The curve in the direction that the calibration declares as its reference.
#[derive(Debug, Clone, PartialEq)]
pub enum FThetaCurve {
    Radius(RadiusCurve),
    Angle(AngleCurve<Polynomial>),
}

impl Curve for FThetaCurve {
    fn limit(&self) -> f64 {
        match self {
            Self::Radius(curve) => curve.limit(),
            Self::Angle(curve) => curve.limit(),
        }
    }

    fn radius(&self, theta: f64) -> f64 {
        match self {
            Self::Radius(curve) => curve.radius(theta),
            Self::Angle(curve) => curve.radius(theta),
        }
    }

    fn angle(&self, radius: f64) -> f64 {
        match self {
            Self::Radius(curve) => curve.angle(radius),
            Self::Angle(curve) => curve.angle(radius),
        }
    }

    fn is_polynomial(&self) -> bool {
        true
    }
}

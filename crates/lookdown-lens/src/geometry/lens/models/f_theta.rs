//! NVIDIA's f-theta camera.

use crate::geometry::lens::{
    ImagePlane, LensError,
    check::{finite, positive},
    curve::FittedCurve,
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
    type Curve = FittedCurve<Polynomial>;

    fn curve(&self) -> Result<Self::Curve, LensError> {
        match (&self.angle_to_pixel, &self.pixel_to_angle) {
            (Some(coefficients), None) => {
                let polynomial = Polynomial::from_axis("angle_to_pixel", coefficients)?;
                Ok(FittedCurve::radius(polynomial))
            }
            (None, Some(coefficients)) => {
                let polynomial = Polynomial::from_axis("pixel_to_angle", coefficients)?;
                Ok(FittedCurve::angle(polynomial))
            }
            _ => Err(LensError::new(
                "give either angle_to_pixel or pixel_to_angle, the one that is exact",
            )),
        }
    }
}

//! The orthographic projection.

use std::f64::consts::FRAC_PI_2;

use crate::geometry::lens::curve::Curve;

lens_parameters! {
    /// `r = sin(theta)`. Valid to 90°.
    pub struct Orthographic: Ideal with OrthographicCurve;
}

impl Curve for OrthographicCurve {
    fn limit(&self) -> f64 {
        FRAC_PI_2
    }

    fn radius(&self, theta: f64) -> f64 {
        theta.sin()
    }

    fn angle(&self, radius: f64) -> f64 {
        radius.min(1.0).asin()
    }
}

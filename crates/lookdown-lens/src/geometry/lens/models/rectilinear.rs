//! The rectilinear projection of the pinhole camera.

use std::f64::consts::FRAC_PI_2;

use crate::geometry::lens::curve::{Curve, POLE_MARGIN};

lens_parameters! {
    /// `r = tan(theta)`. Valid below 90°.
    pub struct Rectilinear: Ideal with RectilinearCurve;
}

impl Curve for RectilinearCurve {
    fn limit(&self) -> f64 {
        FRAC_PI_2 - POLE_MARGIN
    }

    fn radius(&self, theta: f64) -> f64 {
        theta.tan()
    }

    fn angle(&self, radius: f64) -> f64 {
        radius.atan()
    }
}

//! The stereographic projection, which keeps angles in the image.

use std::f64::consts::PI;

use crate::geometry::lens::curve::{Curve, POLE_MARGIN};

lens_parameters! {
    /// `r = 2 tan(theta / 2)`. Valid below 180°.
    pub struct Stereographic: Ideal with StereographicCurve;
}

impl Curve for StereographicCurve {
    fn limit(&self) -> f64 {
        PI - POLE_MARGIN
    }

    fn radius(&self, theta: f64) -> f64 {
        2.0 * (theta / 2.0).tan()
    }

    fn angle(&self, radius: f64) -> f64 {
        2.0 * (radius / 2.0).atan()
    }
}

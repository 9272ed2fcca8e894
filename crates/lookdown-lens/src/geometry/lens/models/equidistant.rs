//! The equidistant projection.

use std::f64::consts::PI;

use crate::geometry::lens::curve::Curve;

lens_parameters! {
    /// `r = theta`. Valid to 180°.
    pub struct Equidistant: Ideal with EquidistantCurve;
}

impl Curve for EquidistantCurve {
    fn limit(&self) -> f64 {
        PI
    }

    fn radius(&self, theta: f64) -> f64 {
        theta
    }

    fn angle(&self, radius: f64) -> f64 {
        radius
    }
}

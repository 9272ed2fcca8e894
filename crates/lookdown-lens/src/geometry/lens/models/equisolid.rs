//! The equisolid-angle projection: equal solid angles cover equal areas of the image.

use std::f64::consts::PI;

use crate::geometry::lens::curve::Curve;

lens_parameters! {
    /// `r = 2 sin(theta / 2)`. Valid to 180°.
    pub struct Equisolid: Ideal with EquisolidCurve;
}

impl Curve for EquisolidCurve {
    fn limit(&self) -> f64 {
        PI
    }

    fn radius(&self, theta: f64) -> f64 {
        2.0 * (theta / 2.0).sin()
    }

    fn angle(&self, radius: f64) -> f64 {
        2.0 * (radius / 2.0).min(1.0).asin()
    }
}

//! The equidistant projection.

use std::f64::consts::PI;

lens_parameters! {
    /// `r = theta`. Valid to 180°.
    pub struct Equidistant: Ideal with EquidistantCurve {
        limit: PI,
        radius: |theta| theta,
        angle: |radius| radius,
    }
}

//! The orthographic projection.

use std::f64::consts::FRAC_PI_2;

lens_parameters! {
    /// `r = sin(theta)`. Valid to 90°.
    pub struct Orthographic: Ideal with OrthographicCurve {
        limit: FRAC_PI_2,
        radius: |theta| theta.sin(),
        angle: |radius| radius.min(1.0).asin(),
    }
}

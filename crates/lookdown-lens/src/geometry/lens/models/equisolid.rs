//! The equisolid-angle projection: equal solid angles cover equal areas of the image.

use std::f64::consts::PI;

lens_parameters! {
    /// `r = 2 sin(theta / 2)`. Valid to 180°.
    pub struct Equisolid: Ideal with EquisolidCurve {
        limit: PI,
        radius: |theta| 2.0 * (theta / 2.0).sin(),
        angle: |radius| 2.0 * (radius / 2.0).min(1.0).asin(),
    }
}

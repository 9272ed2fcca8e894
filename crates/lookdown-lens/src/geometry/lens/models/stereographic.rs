//! The stereographic projection, which keeps angles in the image.

use std::f64::consts::PI;

use crate::geometry::lens::curve::POLE_MARGIN;

lens_parameters! {
    /// `r = 2 tan(theta / 2)`. Valid below 180°.
    pub struct Stereographic: Ideal with StereographicCurve {
        limit: PI - POLE_MARGIN,
        radius: |theta| 2.0 * (theta / 2.0).tan(),
        angle: |radius| 2.0 * (radius / 2.0).atan(),
    }
}

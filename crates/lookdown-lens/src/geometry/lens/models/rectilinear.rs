//! The rectilinear projection of the pinhole camera.

use std::f64::consts::FRAC_PI_2;

use crate::geometry::lens::curve::POLE_MARGIN;

lens_parameters! {
    /// `r = tan(theta)`. Valid below 90°.
    pub struct Rectilinear: Ideal with RectilinearCurve {
        limit: FRAC_PI_2 - POLE_MARGIN,
        radius: |theta| theta.tan(),
        angle: |radius| radius.atan(),
    }
}

//! The sphere model of Mei and Rives: OpenCV's `omnidir`, Kalibr's `omni-radtan`.

use crate::geometry::lens::{
    LensError,
    check::above_minus_one,
    curve::{Curve, POLE_MARGIN},
    distortion::RadialTangential,
    model::Model,
};

lens_parameters! {
    /// `r = sin(theta) / (cos(theta) + xi)`, then [`RadialTangential`] distortion. Valid while
    /// `cos(theta) > −xi` (`−1 / xi` for `xi > 1`) and the distortion is one-to-one. Mei and Rives
    /// 2007.
    pub struct Mei: SkewedPinhole {
        /// Distance of the projection center from the sphere's center, above −1.
        pub xi: f64,
        /// First radial coefficient.
        pub k1: f64,
        /// Second radial coefficient.
        pub k2: f64,
        /// First tangential coefficient.
        pub p1: f64,
        /// Second tangential coefficient.
        pub p2: f64,
    }
}

impl Model for Mei {
    type Curve = SphereCurve;

    fn curve(&self) -> Result<SphereCurve, LensError> {
        let xi = above_minus_one((Self::NAME, "xi"), self.xi)?;
        Ok(SphereCurve { xi })
    }

    fn distortion(&self) -> Result<Option<RadialTangential>, LensError> {
        let &Self { k1, k2, p1, p2, .. } = self;
        let distortion = RadialTangential { k1, k2, p1, p2 };
        distortion.check()?;
        Ok(Some(distortion))
    }
}

/// The curve before distortion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereCurve {
    xi: f64,
}

impl Curve for SphereCurve {
    fn limit(&self) -> f64 {
        if self.xi <= 1.0 {
            (-self.xi).acos() - POLE_MARGIN
        } else {
            (-1.0 / self.xi).acos()
        }
    }

    fn radius(&self, theta: f64) -> f64 {
        let (sin, cos) = theta.sin_cos();
        sin / (self.xi + cos)
    }

    fn angle(&self, radius: f64) -> f64 {
        angle_before_shift(self.xi, radius.atan())
    }
}

/// Returns the angle at the center of the unit sphere of the point that is seen at `shifted` from a
/// center `xi` behind it, by the law of sines.
pub(super) fn angle_before_shift(xi: f64, shifted: f64) -> f64 {
    shifted + (xi * shifted.sin()).clamp(-1.0, 1.0).asin()
}

//! The double sphere model.

use super::{eucm::UnifiedCurve, mei::angle_before_shift};
use crate::geometry::lens::{
    LensError,
    check::{above_minus_one, from_zero_to_one},
    curve::Curve,
    model::Model,
};

lens_parameters! {
    /// `r = sin(theta) / (alpha d + (1 − alpha) g)`, `g = xi + cos(theta)`,
    /// `d = √(sin²(theta) + g²)`. Usenko, Demmel and Cremers 2018, eq. 40 to 45, also for the valid
    /// range.
    pub struct DoubleSphere: Pinhole {
        /// Distance between the two spheres' centers, above −1.
        pub xi: f64,
        /// 0 to 1.
        pub alpha: f64,
    }
}

impl Model for DoubleSphere {
    type Curve = DoubleSphereCurve;

    fn curve(&self) -> Result<DoubleSphereCurve, LensError> {
        let xi = above_minus_one((Self::NAME, "xi"), self.xi)?;
        let alpha = from_zero_to_one((Self::NAME, "alpha"), self.alpha)?;
        let unified = UnifiedCurve { alpha, beta: 1.0 };
        Ok(DoubleSphereCurve { xi, unified })
    }
}

/// A shift of the sphere, then the unified model, whose formula needs no unit vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DoubleSphereCurve {
    xi: f64,
    unified: UnifiedCurve,
}

impl Curve for DoubleSphereCurve {
    /// Returns the published limit, which lies a little inside the fold for ordinary lenses, or the
    /// fold (or pole) itself, whichever comes first.
    fn limit(&self) -> f64 {
        let xi = self.xi;
        let w1 = self.unified.w();
        let w2 = (w1 + xi) / (2.0 * w1 * xi + xi * xi + 1.0).sqrt();
        let fold = if xi <= 1.0 {
            angle_before_shift(xi, (-w1).acos())
        } else {
            (-1.0 / xi).acos()
        };
        (-w2).clamp(-1.0, 1.0).acos().min(fold) - self.unified.margin()
    }

    fn radius(&self, theta: f64) -> f64 {
        let (sin, cos) = theta.sin_cos();
        self.unified.radius_of((sin, self.xi + cos))
    }

    fn angle(&self, radius: f64) -> f64 {
        angle_before_shift(self.xi, self.unified.angle(radius))
    }
}

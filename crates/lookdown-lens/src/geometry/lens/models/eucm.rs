//! The enhanced unified camera model.

use crate::geometry::lens::{
    LensError,
    check::{from_zero_to_one, in_range},
    curve::{Curve, POLE_MARGIN},
    model::Model,
};

lens_parameters! {
    /// `r = sin(theta) / (alpha d + (1 − alpha) cos(theta))`, `d = √(beta sin²(theta) +
    /// cos²(theta))`. Valid while `cos(theta) > −w d`, `w` being the smaller of
    /// `alpha / (1 − alpha)` and its inverse. Khomutenko, Garcia and Martinet 2016.
    pub struct Eucm: Pinhole {
        /// 0 to 1.
        pub alpha: f64,
        /// Above 0.
        pub beta: f64,
    }
}

impl Model for Eucm {
    type Curve = UnifiedCurve;

    fn curve(&self) -> Result<UnifiedCurve, LensError> {
        Ok(UnifiedCurve {
            alpha: from_zero_to_one((Self::NAME, "alpha"), self.alpha)?,
            beta: in_range(
                (Self::NAME, "beta"),
                self.beta,
                |beta| beta > 0.0,
                "above 0",
            )?,
        })
    }
}

/// The curve of `ucm` and `eucm`, and after a shift that of `double_sphere`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnifiedCurve {
    pub(super) alpha: f64,
    pub(super) beta: f64,
}

impl UnifiedCurve {
    /// Returns the radius for the vector (`sin`, `cos`), of any length.
    pub(super) fn radius_of(self, (sin, cos): (f64, f64)) -> f64 {
        let Self { alpha, beta } = self;
        let distance = (beta * sin * sin + cos * cos).sqrt();
        sin / (alpha * distance + (1.0 - alpha) * cos)
    }

    /// Returns the negated cosine at which the curve folds (`alpha` above 1/2) or has its pole.
    pub(super) fn w(self) -> f64 {
        if self.alpha > 0.5 {
            (1.0 - self.alpha) / self.alpha
        } else {
            self.alpha / (1.0 - self.alpha)
        }
    }

    /// Returns the angle by which the curve ends before its pole, radians; a fold needs none.
    pub(super) fn margin(self) -> f64 {
        if self.alpha > 0.5 { 0.0 } else { POLE_MARGIN }
    }
}

impl Curve for UnifiedCurve {
    fn limit(&self) -> f64 {
        let w = self.w();
        let limit = (1.0 - w * w).sqrt().atan2(-w * self.beta.sqrt());
        limit - self.margin()
    }

    fn radius(&self, theta: f64) -> f64 {
        self.radius_of(theta.sin_cos())
    }

    fn angle(&self, radius: f64) -> f64 {
        let Self { alpha, beta } = *self;
        let square = beta * radius * radius;
        let bend = 2.0 * alpha - 1.0;
        // Rounding at the very rim must not make the root imaginary.
        let root = (1.0 - bend * square).max(0.0).sqrt();
        // Two forms of one value: the first cancels near alpha = 1/2, the second near alpha = 1.
        let z = if alpha > 0.75 {
            (alpha * root - (1.0 - alpha)) / bend
        } else {
            (1.0 - alpha * alpha * square) / (alpha * root + 1.0 - alpha)
        };
        radius.atan2(z)
    }
}

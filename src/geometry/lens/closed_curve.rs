//! Curves with a closed form both ways: radius from angle and angle from radius.

use std::f64::consts::{FRAC_PI_2, PI};

/// Curves with a pole end this far before it, in radians.
const POLE_MARGIN: f64 = 1e-6;

/// The normalised radius as a function of the angle; the formulas are at
/// [`LensModel`](super::LensModel).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ClosedCurve {
    Equidistant,
    Equisolid,
    Stereographic,
    Orthographic,
    Rectilinear,
    /// `ucm`, `eucm`.
    Unified {
        alpha: f64,
        beta: f64,
    },
    /// `mei`, before its distortion.
    Sphere {
        xi: f64,
    },
    DoubleSphere {
        xi: f64,
        alpha: f64,
    },
    Fov {
        omega: f64,
    },
}

impl ClosedCurve {
    /// The normalised radius at `theta` radians, up to [`ClosedCurve::limit`].
    pub(super) fn radius(self, theta: f64) -> f64 {
        match self {
            Self::Equidistant => theta,
            Self::Equisolid => 2.0 * (theta / 2.0).sin(),
            Self::Stereographic => 2.0 * (theta / 2.0).tan(),
            Self::Orthographic => theta.sin(),
            Self::Rectilinear => theta.tan(),
            Self::Unified { alpha, beta } => unified_radius(alpha, beta, theta.sin_cos()),
            Self::Sphere { xi } => {
                let (sin, cos) = theta.sin_cos();
                sin / (xi + cos)
            }
            // A shift of the sphere, then the unified model (whose formula wants no unit vector).
            Self::DoubleSphere { xi, alpha } => {
                let (sin, cos) = theta.sin_cos();
                unified_radius(alpha, 1.0, (sin, xi + cos))
            }
            Self::Fov { omega } => {
                let (sin, cos) = theta.sin_cos();
                (2.0 * (omega / 2.0).tan() * sin).atan2(cos) / omega
            }
        }
    }

    /// The angle at which the curve reaches `radius`.
    pub(super) fn angle(self, radius: f64) -> f64 {
        match self {
            Self::Equidistant => radius,
            Self::Equisolid => 2.0 * (radius / 2.0).min(1.0).asin(),
            Self::Stereographic => 2.0 * (radius / 2.0).atan(),
            Self::Orthographic => radius.min(1.0).asin(),
            Self::Rectilinear => radius.atan(),
            Self::Unified { alpha, beta } => unified_angle(alpha, beta, radius),
            Self::Sphere { xi } => angle_before_shift(xi, radius.atan()),
            Self::DoubleSphere { xi, alpha } => {
                angle_before_shift(xi, unified_angle(alpha, 1.0, radius))
            }
            Self::Fov { omega } => {
                let (sin, cos) = (radius * omega).sin_cos();
                sin.atan2(2.0 * (omega / 2.0).tan() * cos)
            }
        }
    }

    /// The largest angle up to which the curve is one-to-one.
    pub(super) fn limit(self) -> f64 {
        match self {
            Self::Equidistant | Self::Equisolid | Self::Fov { .. } => PI,
            Self::Stereographic => PI - POLE_MARGIN,
            Self::Orthographic => FRAC_PI_2,
            Self::Rectilinear => FRAC_PI_2 - POLE_MARGIN,
            Self::Unified { alpha, beta } => {
                let w = unified_w(alpha);
                let limit = (1.0 - w * w).sqrt().atan2(-w * beta.sqrt());
                limit - unified_margin(alpha)
            }
            Self::Sphere { xi } if xi <= 1.0 => (-xi).acos() - POLE_MARGIN,
            Self::Sphere { xi } => (-1.0 / xi).acos(),
            Self::DoubleSphere { xi, alpha } => double_sphere_limit(xi, alpha),
        }
    }
}

/// The unified model for the vector (`sin`, `cos`), of any length.
fn unified_radius(alpha: f64, beta: f64, (sin, cos): (f64, f64)) -> f64 {
    let distance = (beta * sin * sin + cos * cos).sqrt();
    sin / (alpha * distance + (1.0 - alpha) * cos)
}

fn unified_angle(alpha: f64, beta: f64, radius: f64) -> f64 {
    let square = beta * radius * radius;
    let bend = 2.0 * alpha - 1.0;
    // Rounding at the very rim must not make the root imaginary.
    let root = (1.0 - bend * square).max(0.0).sqrt();
    // Two writings of one value: the first cancels near alpha = 1/2, the second near alpha = 1.
    let z = if alpha > 0.75 {
        (alpha * root - (1.0 - alpha)) / bend
    } else {
        (1.0 - alpha * alpha * square) / (alpha * root + 1.0 - alpha)
    };
    radius.atan2(z)
}

/// The cosine, negated, at which the unified model folds (`alpha` above 1/2) or has its pole.
fn unified_w(alpha: f64) -> f64 {
    if alpha > 0.5 {
        (1.0 - alpha) / alpha
    } else {
        alpha / (1.0 - alpha)
    }
}

fn unified_margin(alpha: f64) -> f64 {
    if alpha > 0.5 { 0.0 } else { POLE_MARGIN }
}

/// The angle at the centre of the unit sphere of the point that is seen at `shifted` from a centre
/// `xi` behind it: the law of sines.
fn angle_before_shift(xi: f64, shifted: f64) -> f64 {
    shifted + (xi * shifted.sin()).clamp(-1.0, 1.0).asin()
}

/// The published limit, which lies a little inside the fold for ordinary lenses, and the fold (or
/// pole) itself, whichever comes first.
fn double_sphere_limit(xi: f64, alpha: f64) -> f64 {
    let w1 = unified_w(alpha);
    let w2 = (w1 + xi) / (2.0 * w1 * xi + xi * xi + 1.0).sqrt();
    let fold = if xi <= 1.0 {
        angle_before_shift(xi, (-w1).acos())
    } else {
        (-1.0 / xi).acos()
    };
    (-w2).clamp(-1.0, 1.0).acos().min(fold) - unified_margin(alpha)
}

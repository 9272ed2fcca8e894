//! The curve of a lens in both directions: the radius for an angle and the angle for a radius.

use std::f64::consts::PI;

use super::inversion::{Polynomial, Rising, Tabulated, first_stationary_point};

/// Curves with a pole end this far before it, in radians.
pub(super) const POLE_MARGIN: f64 = 1e-6;

/// The normalized radius as a function of the angle from the optical axis, in radians.
pub(super) trait Curve {
    /// Returns the largest angle up to which the curve is one-to-one; 0 or NaN when it never rises.
    fn limit(&self) -> f64;

    /// Returns the radius at `theta`, which is at most the limit.
    fn radius(&self, theta: f64) -> f64;

    /// Returns the angle at which the curve reaches `radius`.
    fn angle(&self, radius: f64) -> f64;

    /// Returns true for a fitted polynomial, which may turn back at any angle.
    fn is_polynomial(&self) -> bool {
        false
    }
}

/// A radius that is a function of the angle and is fitted by a polynomial, or an angle that is one
/// of the radius.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FittedCurve<F> {
    table: Tabulated<F>,
    gives_angle: bool,
}

impl<F: Rising> FittedCurve<F> {
    /// The angle up to `reach` or the radius at which it stops rising, if that is less.
    pub(super) fn angle_up_to(reach: f64, angle: F) -> Self {
        let end = first_stationary_point(|radius| angle.slope(radius), reach);
        Self {
            table: Tabulated::new(angle, end),
            gives_angle: true,
        }
    }
}

impl FittedCurve<Polynomial> {
    /// The radius at each angle.
    pub(super) fn radius(polynomial: Polynomial) -> Self {
        let limit = first_stationary_point(|theta| polynomial.slope(theta), PI);
        Self {
            table: Tabulated::new(polynomial, limit),
            gives_angle: false,
        }
    }

    /// The angle at each radius.
    pub(super) fn angle(polynomial: Polynomial) -> Self {
        // Twice as far as the lens would reach if it continued at its first slope, and then twice.
        let reach = 4.0 * PI / polynomial.slope(0.0);
        let whole = Self::angle_up_to(reach, polynomial).table;
        // Beyond PI there is nothing more to see.
        let end = if whole.value(whole.end) > PI {
            whole.invert(PI)
        } else {
            whole.end
        };
        Self {
            table: whole.limited_to(end),
            gives_angle: true,
        }
    }
}

impl<F: Rising> Curve for FittedCurve<F> {
    fn limit(&self) -> f64 {
        let end = self.table.end;
        let end = if self.gives_angle {
            self.table.value(end)
        } else {
            end
        };
        // Unlike `min`, this keeps NaN. The end of an angle that is given is at most PI.
        if end > PI { PI } else { end }
    }

    fn radius(&self, theta: f64) -> f64 {
        if self.gives_angle {
            self.table.invert(theta)
        } else {
            self.table.value(theta)
        }
    }

    fn angle(&self, radius: f64) -> f64 {
        if self.gives_angle {
            self.table.value(radius)
        } else {
            self.table.invert(radius)
        }
    }

    fn is_polynomial(&self) -> bool {
        true
    }
}

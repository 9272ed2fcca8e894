//! The curve of a lens in both directions: the radius for an angle and the angle for a radius.

use std::f64::consts::PI;

use super::{
    inversion::{Tabulated, first_stationary_point},
    polynomial::{Polynomial, Rising},
};

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

/// A radius that is a polynomial of the angle.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RadiusCurve(Tabulated<Polynomial>);

impl RadiusCurve {
    pub(super) fn new(polynomial: Polynomial) -> Self {
        let limit = first_stationary_point(|theta| polynomial.slope(theta), PI);
        Self(Tabulated::new(polynomial, limit))
    }
}

impl Curve for RadiusCurve {
    fn limit(&self) -> f64 {
        self.0.end()
    }

    fn radius(&self, theta: f64) -> f64 {
        self.0.value(theta)
    }

    fn angle(&self, radius: f64) -> f64 {
        self.0.invert(radius)
    }

    fn is_polynomial(&self) -> bool {
        true
    }
}

/// An angle that is a function of the radius and is fitted by a polynomial.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AngleCurve<F>(Tabulated<F>);

impl<F: Rising> AngleCurve<F> {
    /// The curve up to `reach` or the radius at which the angle stops rising, if that is less.
    pub(super) fn up_to(reach: f64, angle: F) -> Self {
        let end = first_stationary_point(|radius| angle.slope(radius), reach);
        Self(Tabulated::new(angle, end))
    }
}

impl AngleCurve<Polynomial> {
    pub(super) fn new(polynomial: Polynomial) -> Self {
        // Twice as far as the lens would reach if it continued at its first slope, and then twice.
        let reach = 4.0 * PI / polynomial.slope(0.0);
        let Self(whole) = Self::up_to(reach, polynomial);
        // Beyond PI there is nothing more to see.
        let end = if whole.value(whole.end()) > PI {
            whole.invert(PI)
        } else {
            whole.end()
        };
        Self(whole.limited_to(end))
    }
}

impl<F: Rising> Curve for AngleCurve<F> {
    fn limit(&self) -> f64 {
        let end = self.0.value(self.0.end());
        // Unlike `min`, this keeps NaN.
        if end > PI { PI } else { end }
    }

    fn radius(&self, theta: f64) -> f64 {
        self.0.invert(theta)
    }

    fn angle(&self, radius: f64) -> f64 {
        self.0.value(radius)
    }

    fn is_polynomial(&self) -> bool {
        true
    }
}

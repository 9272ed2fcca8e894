//! A lens curve both ways: the radius for an angle, the angle for a radius.

use std::f64::consts::PI;

use super::{
    closed_curve::ClosedCurve,
    inversion::{Tabulated, first_stationary_point},
    polynomial::{OcamAngle, Polynomial, Rising},
};

/// How far from the centre the angle of an `ocam` lens may still rise, in units of its focal
/// length: the corner of a frame is never that far out.
const OCAM_REACH: f64 = 16.0;

/// A curve, by the way in which its model gives it.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum RadialMap {
    /// Both ways.
    Closed(ClosedCurve),
    /// The radius as a polynomial of the angle.
    Radius(Tabulated<Polynomial>),
    /// The angle as a polynomial of the radius.
    Angle(Tabulated<Polynomial>),
    /// The angle as a function of the radius.
    Ocam(Tabulated<OcamAngle>),
}

impl RadialMap {
    pub(super) fn radius_from(polynomial: Polynomial) -> Self {
        let limit = first_stationary_point(|theta| polynomial.slope(theta), PI);
        Self::Radius(Tabulated::new(polynomial, limit))
    }

    pub(super) fn angle_from(polynomial: Polynomial) -> Self {
        // Twice as far as the lens would reach if it went on as it begins, and then twice.
        let reach = 4.0 * PI / polynomial.slope(0.0);
        let end = first_stationary_point(|radius| polynomial.slope(radius), reach);
        let whole = Tabulated::new(polynomial, end);
        // Behind the camera there is nothing more to see.
        let end = if whole.value(end) > PI {
            whole.invert(PI)
        } else {
            end
        };
        Self::Angle(whole.limited_to(end))
    }

    pub(super) fn ocam(angle: OcamAngle) -> Self {
        let reach = OCAM_REACH * angle.focal();
        let end = first_stationary_point(|radius| angle.slope(radius), reach);
        Self::Ocam(Tabulated::new(angle, end))
    }

    /// The largest angle up to which the curve is one-to-one; 0 or no number when it never rises.
    pub(super) fn limit(&self) -> f64 {
        match self {
            Self::Closed(curve) => curve.limit(),
            Self::Radius(radius) => radius.end(),
            Self::Angle(angle) => angle.value(angle.end()).min(PI),
            Self::Ocam(angle) => angle.value(angle.end()),
        }
    }

    /// The radius at `theta`, at most the limit.
    pub(super) fn radius(&self, theta: f64) -> f64 {
        match self {
            Self::Closed(curve) => curve.radius(theta),
            Self::Radius(radius) => radius.value(theta),
            Self::Angle(angle) => angle.invert(theta),
            Self::Ocam(angle) => angle.invert(theta),
        }
    }

    /// The angle at which the curve reaches `radius`.
    pub(super) fn angle(&self, radius: f64) -> f64 {
        match self {
            Self::Closed(curve) => curve.angle(radius),
            Self::Radius(tabulated) => tabulated.invert(radius),
            Self::Angle(angle) => angle.value(radius),
            Self::Ocam(angle) => angle.value(radius),
        }
    }
}

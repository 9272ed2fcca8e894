//! Standard deviations of a fit, and differences of two cameras in the same values.

use super::{
    camera::{RoomCamera, ideal_shape_slope},
    prior::{Evaluation, Normal, Parameters, Prior},
};
use crate::geometry::Ray;

/// Factor of the difference from an ideal lens that uncertainties allow for.
const LOOSER: f64 = 2.0;

/// Standard deviations of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitUncertainty {
    /// Largest share of the radius between 20° and 80° from the axis.
    pub radius: f64,
    /// Pixels.
    pub center: f64,
    /// Degrees.
    pub level_deg: f64,
}

impl FitUncertainty {
    /// Returns the larger one of each value.
    pub(super) fn larger(&self, other: &Self) -> Self {
        Self {
            radius: self.radius.max(other.radius),
            center: self.center.max(other.center),
            level_deg: self.level_deg.max(other.level_deg),
        }
    }

    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self {
            radius: factor * self.radius,
            center: factor * self.center,
            level_deg: factor * self.level_deg,
        }
    }
}

/// Standard deviations from the curvature of the evidence.
pub(super) fn curvature(camera: &RoomCamera, evaluation: &Evaluation) -> Option<FitUncertainty> {
    Some(deviations(camera, &evaluation.normal.try_inverse()?))
}

/// Standard deviations from the covariance of the parameters.
pub(super) fn deviations(camera: &RoomCamera, covariance: &Normal) -> FitUncertainty {
    let (_, variance) = softest_radius(camera, covariance);
    let both =
        |first: usize| (covariance[(first, first)] + covariance[(first + 1, first + 1)]).sqrt();
    FitUncertainty {
        radius: variance.max(0.0).sqrt(),
        center: both(3),
        level_deg: both(5).to_degrees(),
    }
}

/// Standard deviations if the lens may differ more from an ideal one than the fit assumes. They are
/// larger where the edges hardly tell the second coefficient, as for a camera that looks straight
/// down.
pub(super) fn loose_curvature(
    camera: &RoomCamera,
    evaluation: &Evaluation,
    prior: &Prior,
) -> Option<FitUncertainty> {
    Some(deviations(camera, &loose_covariance(evaluation, prior)?))
}

/// The covariance of the parameters under the same assumption.
pub(super) fn loose_covariance(evaluation: &Evaluation, prior: &Prior) -> Option<Normal> {
    let mut normal = evaluation.normal;
    let information = 1.0 / (prior.k2_sigma * prior.k2_sigma);
    normal[(2, 2)] -= information * (1.0 - 1.0 / (LOOSER * LOOSER));
    normal.try_inverse()
}

/// The step of all parameters that changes the most uncertain radius by its standard deviation and
/// costs the least evidence.
pub(super) fn radius_step(camera: &RoomCamera, evaluation: &Evaluation) -> Option<Parameters> {
    let covariance = evaluation.normal.try_inverse()?;
    let (slopes, variance) = softest_radius(camera, &covariance);
    (variance > 0.0).then(|| covariance * slopes / variance.sqrt())
}

/// The slopes of the relative radius with the parameters at the angle where it is most uncertain,
/// and its variance.
fn softest_radius(camera: &RoomCamera, covariance: &Normal) -> (Parameters, f64) {
    let ideal = ideal_shape_slope(camera.k1);
    let at = |theta: f64| {
        let (radius, _) = camera.curve(theta);
        let (square, cube) = (theta * theta, theta.powi(3));
        let along = cube * (ideal[0] + square * (ideal[1] + square * ideal[2]));
        let mut slopes = Parameters::zeros();
        slopes[0] = 1.0;
        slopes[1] = along / radius;
        slopes[2] = cube * square / radius;
        (slopes, slopes.dot(&(covariance * slopes)))
    };
    let all = angles().map(at);
    all.fold((Parameters::zeros(), 0.0), |most, next| {
        if next.1 > most.1 { next } else { most }
    })
}

/// Largest relative difference of the radius between 20° and 80°, and the angle between verticals.
pub(super) fn distance(one: &RoomCamera, other: &RoomCamera) -> (f64, f64) {
    let radius = angles().map(|theta| {
        (one.focal * one.curve(theta).0 / (other.focal * other.curve(theta).0) - 1.0).abs()
    });
    let level = (one.room * Ray::z()).angle(&(other.room * Ray::z()));
    (radius.fold(0.0, f64::max), level)
}

/// 20° to 80°, radians.
fn angles() -> impl Iterator<Item = f64> {
    (2..=8).map(|tens| (10.0 * f64::from(tens)).to_radians())
}

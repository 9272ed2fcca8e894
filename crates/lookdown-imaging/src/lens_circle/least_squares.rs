//! The circle that fits rim points best, robust against a minority of outliers.
//!
//! Iteratively reweighted Gauss–Newton on the geometric distance, with Tukey's biweight (Holland
//! and Welsch, 1977), which gives distant points no weight.

use nalgebra::{Matrix3, Vector3};

use super::LensCircle;

const ITERATIONS: usize = 12;
/// Tukey's constant: 95 % efficiency on normally distributed errors.
const CUTOFF_IN_SIGMAS: f64 = 4.685;
/// The standard deviation of a normal distribution in median absolute deviations.
const SIGMA_IN_MEDIAN_DEVIATIONS: f64 = 1.4826;
/// A smaller spread, in pixels, is numerical noise and would exclude good points.
const MIN_SIGMA: f64 = 0.25;
/// A circle has three unknowns. Fewer points leave no redundancy to detect outliers.
const MIN_POINTS: usize = 12;

/// Fits a circle to points, starting from `start`. Returns `None` when there are too few points or
/// they do not determine a circle.
pub(super) fn circle(points: &[[f64; 2]], start: &LensCircle) -> Option<LensCircle> {
    if points.len() < MIN_POINTS {
        return None;
    }
    let mut circle = *start;
    for _ in 0..ITERATIONS {
        let cutoff = CUTOFF_IN_SIGMAS * spread(points, &circle);
        let mut normal = Matrix3::zeros();
        let mut right_side = Vector3::zeros();
        for point in points {
            let distance = circle.distance(*point);
            let weight = (1.0 - (distance / cutoff).powi(2)).max(0.0).powi(2);
            let from_center = distance + circle.radius;
            let gradient = Vector3::new(
                (point[0] - circle.cx) / from_center,
                (point[1] - circle.cy) / from_center,
                1.0,
            );
            normal += weight * gradient * gradient.transpose();
            right_side += weight * distance * gradient;
        }
        let step = normal.cholesky()?.solve(&right_side);
        circle.cx += step.x;
        circle.cy += step.y;
        circle.radius += step.z;
        if !(step.norm().is_finite() && circle.radius > 1.0) {
            return None;
        }
    }
    Some(circle)
}

/// Robust standard deviation of the points around the circle, in pixels.
fn spread(points: &[[f64; 2]], circle: &LensCircle) -> f64 {
    let mut deviations: Vec<f64> = points
        .iter()
        .map(|point| circle.distance(*point).abs())
        .collect();
    let middle = deviations.len() / 2;
    let (_, median, _) = deviations.select_nth_unstable_by(middle, f64::total_cmp);
    (*median * SIGMA_IN_MEDIAN_DEVIATIONS).max(MIN_SIGMA)
}

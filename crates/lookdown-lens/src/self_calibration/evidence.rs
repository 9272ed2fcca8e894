//! The evidence of edge curves for a camera, and the next step of its parameters.
//!
//! A straight edge and the center of projection span a plane. The plane of an edge along a
//! direction of the room contains that direction, so it has one degree of freedom. The residual of
//! a curve is the distance in pixels of its points from the best such plane. A curve of any other
//! direction is an outlier. The evidence is the logarithm of the ratio of both likelihoods.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector};

use super::{
    camera::{Angles, RoomCamera, SeenRay, ideal_shape_slope},
    edge_curve::EdgeCurve,
    evaluation::{Evaluation, PARAMETERS},
    prior::Prior,
};
use crate::geometry::Ray;

/// Standard deviation of a point across its edge, in pixels.
const SIGMA_PIXELS: f64 = 0.2;
/// Standard deviation of the direction of an edge from that of the room, radians.
const SIGMA_DIRECTION: f64 = 0.004;
/// Share of curves along none of the directions, before they are seen.
const OUTLIER_SHARE: f64 = 0.4;
/// One curve along one direction.
struct Fitted {
    normal: Ray,
    likelihood: f64,
    direction: usize,
}

/// Evaluates a camera. `blur` multiplies the standard deviations, to find the way from afar.
/// `weights` are one per curve. Returns `None` if the curve `r(theta)` turns back.
pub(super) fn evaluate(
    camera: &RoomCamera,
    curves: &[EdgeCurve],
    weights: &[f64],
    prior: &Prior,
    blur: f64,
    with_steps: bool,
) -> Option<Evaluation> {
    let angles = Angles::of(camera, prior.radius)?;
    let directions = camera.directions();
    let mut result = Evaluation {
        evidence: 0.0,
        normal: DMatrix::zeros(PARAMETERS, PARAMETERS),
        right: DVector::zeros(PARAMETERS),
        shares: vec![0.0; directions.len()],
        explained: Vec::with_capacity(curves.len()),
    };
    let mut rays: Vec<SeenRay> = Vec::new();
    let mut total = 0.0;
    #[expect(clippy::cast_precision_loss, reason = "a few directions")]
    let share = (1.0 - OUTLIER_SHARE) / directions.len() as f64;
    let mut fits = Vec::with_capacity(directions.len());
    for (curve, weight) in curves.iter().zip(weights) {
        if *weight <= 0.0 {
            result.explained.push(0.0);
            continue;
        }
        rays.clear();
        rays.extend(curve.points.iter().map(|point| angles.ray(camera, *point)));
        let length = curve.length();
        #[expect(clippy::cast_precision_loss, reason = "a few points")]
        let count = rays.len() as f64;
        let lever = length / 12.0_f64.sqrt();
        let sigma = blur * SIGMA_PIXELS.hypot(SIGMA_DIRECTION * lever);
        // The prior density of an edge's angle is uniform over half a turn.
        let sigma_angle = sigma / (lever * count.sqrt());
        let gain = (PI / (TAU.sqrt() * sigma_angle)).max(1.0);
        fits.clear();
        for (index, direction) in directions.iter().enumerate() {
            let (normal, squares) = best_plane(&rays, direction);
            let likelihood = share * gain * (-0.5 * squares / (sigma * sigma)).exp();
            fits.push(Fitted {
                normal,
                likelihood,
                direction: index,
            });
        }
        let inlier: f64 = fits.iter().map(|fit| fit.likelihood).sum();
        let sum = OUTLIER_SHARE + inlier;
        result.evidence += weight * (sum / (OUTLIER_SHARE + share)).ln();
        total += weight * length;
        result.explained.push(inlier / sum);
        for fit in &fits {
            let responsibility = fit.likelihood / sum;
            result.shares[fit.direction] += weight * length * responsibility;
            if with_steps && responsibility > 1e-3 {
                let scale = weight * responsibility / (sigma * sigma);
                add_curve(&mut result, camera, &rays, fit, &directions, scale);
            }
        }
    }
    for share in &mut result.shares {
        *share /= total.max(1e-9);
    }
    prior.add_to(&mut result, camera, &angles);
    Some(result)
}

/// Distance in pixels from a plane, per unit of the scalar product with its normal.
fn pixels_per_unit(seen: &SeenRay, normal: &Ray) -> f64 {
    let outward = normal.dot(&seen.outward) * seen.theta_per_pixel;
    let around = normal.dot(&seen.around) * seen.around_per_pixel;
    1.0 / outward.hypot(around).max(1e-7)
}

/// The plane through a direction that fits rays best, and the sum of its squared residuals.
fn best_plane(rays: &[SeenRay], direction: &Ray) -> (Ray, f64) {
    let (first, second) = across(direction);
    let mut normal: Option<Ray> = None;
    for _ in 0..2 {
        let [mut xx, mut xy, mut yy] = [0.0; 3];
        for seen in rays {
            let (x, y) = (first.dot(&seen.ray), second.dot(&seen.ray));
            let weight = normal.map_or(1.0, |normal| pixels_per_unit(seen, &normal).powi(2));
            xx += weight * x * x;
            xy += weight * x * y;
            yy += weight * y * y;
        }
        // The eigenvector of the smaller eigenvalue.
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy) + PI / 2.0;
        normal = Some(first * angle.cos() + second * angle.sin());
    }
    let normal = normal.unwrap_or(first);
    let squares = rays
        .iter()
        .map(|seen| (normal.dot(&seen.ray) * pixels_per_unit(seen, &normal)).powi(2));
    (normal, squares.sum())
}

/// Two unit vectors across a direction and each other.
fn across(direction: &Ray) -> (Ray, Ray) {
    let helper = if direction.x.abs() < 0.6 {
        Ray::x()
    } else {
        Ray::y()
    };
    let first = direction.cross(&helper).normalize();
    (first, direction.cross(&first))
}

/// Adds the normal equations of a curve along a direction, its own plane eliminated.
fn add_curve(
    result: &mut Evaluation,
    camera: &RoomCamera,
    rays: &[SeenRay],
    fit: &Fitted,
    directions: &[Ray; 3],
    scale: f64,
) {
    let direction = &directions[fit.direction];
    let turned = direction.cross(&fit.normal);
    let ideal = ideal_shape_slope(camera.k1);
    let mut row = [0.0; PARAMETERS];
    // Sums for the elimination of the plane's own angle.
    let mut own = 0.0;
    let mut own_residual = 0.0;
    let mut own_rows = [0.0; PARAMETERS];
    for seen in rays {
        let factor = pixels_per_unit(seen, &fit.normal);
        let residual = factor * fit.normal.dot(&seen.ray);
        let outward = factor * fit.normal.dot(&seen.outward);
        let around = factor * fit.normal.dot(&seen.around);
        let theta = seen.theta;
        let (radius, _) = camera.curve(theta);
        // Change of the angle with the radius in focal lengths.
        let per_focal = seen.theta_per_pixel * camera.focal;
        let cube = theta.powi(3);
        row[0] = -outward * per_focal * radius;
        let along = ideal[0] + theta * theta * (ideal[1] + theta * theta * ideal[2]);
        row[1] = -outward * per_focal * cube * along;
        row[2] = -outward * per_focal * cube * theta * theta;
        let (out, round) = (
            outward * seen.theta_per_pixel,
            around * seen.around_per_pixel,
        );
        row[3] = -(out * seen.side[0] - round * seen.side[1]);
        row[4] = -(out * seen.side[1] + round * seen.side[0]);
        // The normal turns with the room.
        let turn = fit.normal.cross(&seen.ray) * factor;
        row[5..8].copy_from_slice(turn.as_slice());
        let own_slope = factor * turned.dot(&seen.ray);
        own += own_slope * own_slope;
        own_residual += own_slope * residual;
        for index in 0..PARAMETERS {
            own_rows[index] += own_slope * row[index];
            result.right[index] -= scale * row[index] * residual;
            for other in 0..=index {
                result.normal[(index, other)] += scale * row[index] * row[other];
            }
        }
    }
    let own = own.max(1e-12);
    for index in 0..PARAMETERS {
        result.right[index] += scale * own_rows[index] * own_residual / own;
        for other in 0..=index {
            result.normal[(index, other)] -= scale * own_rows[index] * own_rows[other] / own;
        }
    }
}

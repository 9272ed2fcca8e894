//! The evidence of edge curves for a camera, and the next step of its parameters.
//!
//! A straight edge and the center of projection span a plane. The plane of an edge along a
//! direction of the room contains that direction, so it has one degree of freedom. The residual of
//! a curve is the distance in pixels of its points from the best such plane. A curve of any other
//! direction is an outlier. The evidence is the logarithm of the ratio of both likelihoods.

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, DVector, Rotation3, Vector3};

use super::{
    camera::{Angles, RoomCamera, SeenRay, ideal_shape_slope},
    edge_curve::EdgeCurve,
};
use crate::geometry::Ray;

/// Standard deviation of a point across its edge, in pixels.
pub(super) fn ev(n:&str,d:f64)->f64{ use std::sync::OnceLock; use std::collections::HashMap; use std::sync::Mutex; static M:OnceLock<Mutex<HashMap<String,f64>>>=OnceLock::new(); *M.get_or_init(Default::default).lock().unwrap().entry(n.to_string()).or_insert_with(||std::env::var(n).ok().and_then(|v|v.parse().ok()).unwrap_or(d)) }
const SIGMA_PIXELS: f64 = 0.2;
/// Standard deviation of the direction of an edge from that of the room, radians.
const SIGMA_DIRECTION: f64 = 0.004;
/// Share of curves along none of the directions, before they are seen.
const OUTLIER_SHARE: f64 = 0.4;
/// Parameters without further headings: focal length, two of the shape, center, rotation.
pub(super) const PARAMETERS: usize = 8;

/// What is assumed before any curve is seen.
#[derive(Debug, Clone)]
pub(super) struct Prior {
    /// Center of the lens circle in pixels.
    pub center: [f64; 2],
    /// Standard deviation of the optical center from it, pixels.
    pub center_sigma: f64,
    /// Radius up to which the curve must rise, pixels.
    pub radius: f64,
    /// Standard deviation of the second coefficient from that of an ideal lens.
    pub k2_sigma: f64,
    /// Angle at the radius and its standard deviation, radians.
    pub rim: (f64, f64),
}

/// Evidence, and the normal equations of the parameters.
pub(super) struct Evaluation {
    /// Logarithm of the likelihood ratio, plus that of the prior.
    pub evidence: f64,
    /// Gauss-Newton matrix.
    pub normal: DMatrix<f64>,
    /// Right side.
    pub right: DVector<f64>,
    /// Share of the lengths of all curves that each direction explains.
    pub shares: Vec<f64>,
    /// Explained share of each curve.
    pub explained: Vec<f64>,
}

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
    let size = PARAMETERS + camera.headings.len();
    let mut result = Evaluation {
        evidence: 0.0,
        normal: DMatrix::zeros(size, size),
        right: DVector::zeros(size),
        shares: vec![0.0; directions.len()],
        explained: Vec::with_capacity(curves.len()),
    };
    let (sp,sd)=(ev("SP",SIGMA_PIXELS),ev("SD",SIGMA_DIRECTION));
    let mut rays: Vec<SeenRay> = Vec::new();
    let mut total = 0.0;
    #[expect(clippy::cast_precision_loss, reason = "a few directions")]
    let share = (1.0 - OUTLIER_SHARE) / directions.len() as f64;
    let mut fits = Vec::with_capacity(directions.len());
    for (curve, weight) in curves.iter().zip(weights) {
        rays.clear();
        rays.extend(curve.points.iter().map(|point| angles.ray(camera, *point)));
        let length = curve.length();
        #[expect(clippy::cast_precision_loss, reason = "a few points")]
        let count = rays.len() as f64;
        let lever = length / 12.0_f64.sqrt();
        let sigma = blur * sp.hypot(sd * lever);
        // The prior density of an edge's angle is uniform over half a turn.
        let sigma_angle = sigma / (lever * count.sqrt());
        let gain = (PI / (TAU.sqrt() * sigma_angle)).max(1.0);
        fits.clear();
        for (index, direction) in directions.iter().enumerate() {
            let (normal, squares) = best_plane(&rays, direction);
            let likelihood = share * gain * (-0.5 * squares / (sigma * sigma)).exp();
            fits.push(Fitted { normal, likelihood, direction: index });
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
    add_prior(&mut result, camera, prior, &angles);
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
    let squares = rays.iter().map(|seen| {
        (normal.dot(&seen.ray) * pixels_per_unit(seen, &normal)).powi(2)
    });
    (normal, squares.sum())
}

/// Two unit vectors across a direction and each other.
fn across(direction: &Ray) -> (Ray, Ray) {
    let helper = if direction.x.abs() < 0.6 { Ray::x() } else { Ray::y() };
    let first = direction.cross(&helper).normalize();
    (first, direction.cross(&first))
}

/// Adds the normal equations of a curve along a direction, its own plane eliminated.
fn add_curve(
    result: &mut Evaluation,
    camera: &RoomCamera,
    rays: &[SeenRay],
    fit: &Fitted,
    directions: &[Ray],
    scale: f64,
) {
    let size = result.right.len();
    let direction = &directions[fit.direction];
    let turned = direction.cross(&fit.normal);
    let heading = fit.direction.checked_sub(3).map(|further| further / 2);
    let ideal = ideal_shape_slope(camera.k1);
    let mut row = [0.0; 16];
    // Sums for the elimination of the plane's own angle.
    let mut own = 0.0;
    let mut own_residual = 0.0;
    let mut own_rows = [0.0; 16];
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
        let (out, round) = (outward * seen.theta_per_pixel, around * seen.around_per_pixel);
        row[3] = -(out * seen.side[0] - round * seen.side[1]);
        row[4] = -(out * seen.side[1] + round * seen.side[0]);
        // The normal turns with the room.
        let turn = fit.normal.cross(&seen.ray) * factor;
        row[5..8].copy_from_slice(turn.as_slice());
        row[8..size].fill(0.0);
        if let Some(heading) = heading {
            row[PARAMETERS + heading] = turn.dot(&directions[0]);
        }
        let own_slope = factor * turned.dot(&seen.ray);
        own += own_slope * own_slope;
        own_residual += own_slope * residual;
        for index in 0..size {
            own_rows[index] += own_slope * row[index];
            result.right[index] -= scale * row[index] * residual;
            for other in 0..=index {
                result.normal[(index, other)] += scale * row[index] * row[other];
            }
        }
    }
    let own = own.max(1e-12);
    for index in 0..size {
        result.right[index] += scale * own_rows[index] * own_residual / own;
        for other in 0..=index {
            result.normal[(index, other)] -= scale * own_rows[index] * own_rows[other] / own;
        }
    }
}

fn add_prior(result: &mut Evaluation, camera: &RoomCamera, prior: &Prior, angles: &Angles) {
    let mut add = |rows: &[(usize, f64)], residual: f64, sigma: f64| {
        let weight = 1.0 / (sigma * sigma);
        result.evidence -= 0.5 * weight * residual * residual;
        for (index, slope) in rows {
            result.right[*index] -= weight * slope * residual;
            for (other, other_slope) in rows {
                if other <= index {
                    result.normal[(*index, *other)] += weight * slope * other_slope;
                }
            }
        }
    };
    for axis in 0..2 {
        let off = camera.center[axis] - prior.center[axis];
        add(&[(3 + axis, 1.0)], off, prior.center_sigma);
    }
    add(&[(2, 1.0)], camera.k2_offset, prior.k2_sigma);
    // Between orthographic and stereographic.
    add(&[(1, 1.0)], camera.k1 + 0.03, ev("K1S",0.15));
    let theta = angles.theta(prior.radius / camera.focal);
    let (radius, slope) = camera.curve(theta);
    let ideal = ideal_shape_slope(camera.k1);
    let cube = theta.powi(3);
    let rows = [
        (0, -radius / slope),
        (1, -cube * (ideal[0] + theta * theta * (ideal[1] + theta * theta * ideal[2])) / slope),
        (2, -cube * theta * theta / slope),
    ];
    add(&rows, theta - prior.rim.0, prior.rim.1);
    for index in 0..result.right.len() {
        for other in 0..index {
            result.normal[(other, index)] = result.normal[(index, other)];
        }
    }
}

/// The camera after a step of its parameters.
pub(super) fn stepped(camera: &RoomCamera, step: &DVector<f64>) -> RoomCamera {
    RoomCamera {
        focal: camera.focal * step[0].exp(),
        k1: camera.k1 + step[1],
        k2_offset: camera.k2_offset + step[2],
        center: [camera.center[0] + step[3], camera.center[1] + step[4]],
        room: Rotation3::new(Vector3::new(step[5], step[6], step[7])) * camera.room,
        headings: camera
            .headings
            .iter()
            .enumerate()
            .map(|(index, heading)| heading + step[PARAMETERS + index])
            .collect(),
    }
}

/// Climbs to the nearest maximum of the evidence (Levenberg-Marquardt).
pub(super) fn climb(
    mut camera: RoomCamera,
    curves: &[EdgeCurve],
    weights: &[f64],
    prior: &Prior,
    blur: f64,
    steps: usize,
) -> Option<(RoomCamera, Evaluation)> {
    let mut current = evaluate(&camera, curves, weights, prior, blur, true)?;
    let mut damping = 1e-3;
    for _ in 0..steps {
        let mut damped = current.normal.clone();
        for index in 0..damped.nrows() {
            damped[(index, index)] *= 1.0 + damping;
        }
        let Some(cholesky) = damped.cholesky() else { break };
        let step = cholesky.solve(&current.right);
        let next = stepped(&camera, &step);
        match evaluate(&next, curves, weights, prior, blur, true) {
            Some(evaluation) if evaluation.evidence > current.evidence => {
                let gain = evaluation.evidence - current.evidence;
                (camera, current) = (next, evaluation);
                damping = (damping * 0.2).max(1e-6);
                if gain < 1e-3 {
                    break;
                }
            }
            _ => {
                damping *= 10.0;
                if damping > 1e4 {
                    break;
                }
            }
        }
    }
    Some((camera, current))
}

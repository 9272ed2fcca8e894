//! The evidence of edge curves for a camera, and the next step of its parameters.
//!
//! A straight edge and the center of projection span a plane. The plane of an edge along a
//! direction of the room contains that direction, so it has one degree of freedom. The residual of
//! a curve is the distance in pixels of its points from the best such plane. A curve of any other
//! direction is an outlier. The evidence is the logarithm of the ratio of both likelihoods.
//!
//! The distance of a point from a plane in pixels, and its change with the parameters of a camera.
//!
//! The distance is `F n·u`, with the normal `n`, the ray `u` and `F = 1 / |grad(n·u)|`. The change
//! of `F` counts as well: it is small for each point, but it has the same sign for all of them.
//! Terms of the square of the distance are left out.

use std::f64::consts::{PI, TAU};

use super::{
    camera::{Angles, RoomCamera, SeenRay, Shape, ideal_shape_slope},
    prior::{Evaluation, Normal, PARAMETERS, Parameters, Prior},
};
use crate::geometry::Ray;

/// Standard deviation of a point across its edge, in pixels.
const SIGMA_PIXELS: f64 = 0.2;
/// Standard deviation of the direction of an edge from that of the room, radians.
const SIGMA_DIRECTION: f64 = 0.004;
/// Share of curves along none of the directions, before they are seen.
const OUTLIER_SHARE: f64 = 0.4;
/// Share of curves along each of the three directions.
const SHARE: f64 = (1.0 - OUTLIER_SHARE) / 3.0;
/// Squared distances from a first plane, in variances, from which a curve has no likelihood along a
/// direction. It would be below 1e-40.
const FAR: f64 = 200.0;

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
    let angles = Angles::from_camera(camera, prior.circle.radius)?;
    let directions = camera.directions();
    let mut result = Evaluation {
        evidence: 0.0,
        normal: Normal::zeros(),
        right: Parameters::zeros(),
        shares: vec![0.0; directions.len()],
        explained: Vec::with_capacity(curves.len()),
    };
    let mut rays: Vec<SeenRay> = Vec::new();
    let mut total = 0.0;
    let mut fits = Vec::with_capacity(directions.len());
    for (curve, weight) in curves.iter().zip(weights) {
        if *weight <= 0.0 {
            result.explained.push(0.0);
            continue;
        }
        rays.clear();
        rays.extend(curve.points.iter().map(|point| angles.ray(camera, *point)));
        let length = curve.length();
        let sigma = fit_directions(curve, &rays, &directions, blur, &mut fits);
        let inlier: f64 = fits.iter().map(|fit| fit.likelihood).sum();
        let sum = OUTLIER_SHARE + inlier;
        result.evidence += weight * (sum / (OUTLIER_SHARE + SHARE)).ln();
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

/// Returns the direction, an index, that a curve follows more likely than the others or none.
pub(super) fn followed_direction(
    curve: &EdgeCurve,
    camera: &RoomCamera,
    angles: &Angles,
) -> Option<usize> {
    let points = curve.points.iter();
    let rays: Vec<SeenRay> = points.map(|point| angles.ray(camera, *point)).collect();
    let mut fits = Vec::new();
    fit_directions(curve, &rays, &camera.directions(), 1.0, &mut fits);
    let all = OUTLIER_SHARE + fits.iter().map(|fit| fit.likelihood).sum::<f64>();
    let followed = fits.iter().find(|fit| fit.likelihood > 0.5 * all);
    followed.map(|fit| fit.direction)
}

/// Finds the planes through the directions that fit a curve, without those that are far from it.
/// Returns the standard deviation of the distances of its points, in pixels.
fn fit_directions(
    curve: &EdgeCurve,
    rays: &[SeenRay],
    directions: &[Ray; 3],
    blur: f64,
    fits: &mut Vec<Fitted>,
) -> f64 {
    let count = rays.len() as f64;
    let lever = curve.length() / 12.0_f64.sqrt();
    let (across, turned) = (SIGMA_PIXELS * curve.scale, SIGMA_DIRECTION * lever);
    let sigma = blur * (across * across + turned * turned).sqrt();
    // The prior density of an edge's angle is uniform over half a turn.
    let sigma_angle = sigma / (lever * count.sqrt());
    let gain = (PI / (TAU.sqrt() * sigma_angle)).max(1.0);
    let least = least_squared_pixels_per_unit(rays);
    let farthest = FAR * sigma * sigma;
    fits.clear();
    for (index, direction) in directions.iter().enumerate() {
        let Some((normal, squares)) = best_plane(rays, direction, least, farthest) else {
            continue;
        };
        fits.push(Fitted {
            normal,
            likelihood: SHARE * gain * (-0.5 * squares / (sigma * sigma)).exp(),
            direction: index,
        });
    }
    sigma
}

/// The plane through a direction that fits rays best, and the sum of its squared residuals, or
/// `None` if a first, unweighted plane is farther. `least` is that of all rays and normals
/// ([`least_squared_pixels_per_unit`]): most curves are too far from a direction by it alone.
fn best_plane(rays: &[SeenRay], direction: &Ray, least: f64, farthest: f64) -> Option<(Ray, f64)> {
    let (first, second) = across(direction);
    let mut moments = [0.0; 3];
    for seen in rays {
        add_moments(
            &mut moments,
            1.0,
            first.dot(&seen.ray),
            second.dot(&seen.ray),
        );
    }
    if least * least_moment(moments) > farthest {
        return None;
    }
    let normal = thinnest(moments, &first, &second);
    let mut moments = [0.0; 3];
    let mut squares = 0.0;
    for seen in rays {
        let weight = squared_pixels_per_unit(seen, &normal);
        squares += weight * normal.dot(&seen.ray).powi(2);
        add_moments(
            &mut moments,
            weight,
            first.dot(&seen.ray),
            second.dot(&seen.ray),
        );
    }
    if squares > farthest {
        return None;
    }
    let normal = thinnest(moments, &first, &second);
    // A step of the plane's angle to the least sum, so that its slope with the angle is zero.
    let turned = direction.cross(&normal);
    let [mut slopes, mut slope_residuals] = [0.0; 2];
    for seen in rays {
        let (residual, slope) = own_slope(seen, &normal, &turned);
        slopes += slope * slope;
        slope_residuals += slope * residual;
    }
    let normal = (normal - turned * (slope_residuals / slopes.max(1e-12))).normalize();
    let squares = rays
        .iter()
        .map(|seen| squared_pixels_per_unit(seen, &normal) * normal.dot(&seen.ray).powi(2));
    Some((normal, squares.sum()))
}

fn add_moments([xx, xy, yy]: &mut [f64; 3], weight: f64, x: f64, y: f64) {
    *xx += weight * x * x;
    *xy += weight * x * y;
    *yy += weight * y * y;
}

/// The smaller eigenvalue.
fn least_moment([xx, xy, yy]: [f64; 3]) -> f64 {
    let (difference, twice) = (xx - yy, 2.0 * xy);
    0.5 * (xx + yy - (difference * difference + twice * twice).sqrt())
}

/// The direction of least moment: the eigenvector of the smaller eigenvalue.
fn thinnest([xx, xy, yy]: [f64; 3], first: &Ray, second: &Ray) -> Ray {
    let (difference, twice) = (xx - yy, 2.0 * xy);
    let length = (difference * difference + twice * twice).sqrt();
    // (-sin, cos) of half the angle of (difference, twice), without cancellation.
    let (x, y) = if difference > 0.0 {
        (-twice, length + difference)
    } else {
        (-(length - difference), twice)
    };
    let norm = (x * x + y * y).sqrt();
    if norm < f64::MIN_POSITIVE {
        return *second;
    }
    first * (x / norm) + second * (y / norm)
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
    let turned = directions[fit.direction].cross(&fit.normal);
    let lens = LensSlopes::new(camera);
    let mut normal = [[0.0; PARAMETERS]; PARAMETERS];
    let mut right = [0.0; PARAMETERS];
    // Sums for the elimination of the plane's own angle.
    let mut own = 0.0;
    let mut own_residual = 0.0;
    let mut own_rows = [0.0; PARAMETERS];
    for seen in rays {
        let Residual {
            pixels: residual,
            row,
            own_slope,
        } = Residual::new(seen, &fit.normal, &turned, &lens);
        own += own_slope * own_slope;
        own_residual += own_slope * residual;
        for index in 0..PARAMETERS {
            own_rows[index] += own_slope * row[index];
            right[index] -= row[index] * residual;
            for other in 0..PARAMETERS {
                normal[index][other] += row[index] * row[other];
            }
        }
    }
    let own = own.max(1e-12);
    for index in 0..PARAMETERS {
        result.right[index] += scale * (right[index] + own_rows[index] * own_residual / own);
        for other in 0..=index {
            result.normal[(index, other)] +=
                scale * (normal[index][other] - own_rows[index] * own_rows[other] / own);
        }
    }
}

/// A residual with its slopes.
struct Residual {
    /// Signed distance from the plane.
    pixels: f64,
    /// Change with each parameter.
    row: [f64; PARAMETERS],
    /// Change with the angle of the plane around its direction.
    own_slope: f64,
}

/// Values of a camera that all residuals need.
struct LensSlopes {
    focal: f64,
    shape: Shape,
    /// Change of the shape with its first coefficient.
    along: Shape,
}

impl LensSlopes {
    fn new(camera: &RoomCamera) -> Self {
        Self {
            focal: camera.focal,
            shape: camera.shape(),
            along: ideal_shape_slope(camera.k1),
        }
    }
}

/// Square of the distance in pixels from a plane, per unit of the scalar product with its normal.
fn squared_pixels_per_unit(seen: &SeenRay, normal: &Ray) -> f64 {
    let outward = normal.dot(&seen.outward);
    let around = normal.dot(&seen.around);
    1.0 / (outward * outward + around * around).max(1e-14)
}

/// The least of [`squared_pixels_per_unit`] for all rays and normals: `outward` and `around` are
/// orthogonal.
fn least_squared_pixels_per_unit(rays: &[SeenRay]) -> f64 {
    let most = rays.iter().map(|seen| {
        let outward = seen.outward.norm_squared();
        outward.max(seen.around.norm_squared())
    });
    1.0 / most.fold(1e-14, f64::max)
}

/// The residual, and its change with the angle of the plane: `turned` is the change of the normal.
fn own_slope(seen: &SeenRay, normal: &Ray, turned: &Ray) -> (f64, f64) {
    let square = squared_pixels_per_unit(seen, normal);
    let factor = square.sqrt();
    let residual = factor * normal.dot(&seen.ray);
    let outward = normal.dot(&seen.outward) * turned.dot(&seen.outward);
    let around = normal.dot(&seen.around) * turned.dot(&seen.around);
    let slope = factor * turned.dot(&seen.ray) - residual * square * (outward + around);
    (residual, slope)
}

impl Residual {
    fn new(seen: &SeenRay, normal: &Ray, turned: &Ray, lens: &LensSlopes) -> Self {
        let (residual, own_slope) = own_slope(seen, normal, turned);
        let square = squared_pixels_per_unit(seen, normal);
        let factor = square.sqrt();
        let (outward, around) = (normal.dot(&seen.outward), normal.dot(&seen.around));
        // Changes of the factor with the logarithms of the outward and of the around part.
        let by_outward = -residual * square * outward * outward;
        let by_around = -residual * square * around * around;
        let mut row = [0.0; PARAMETERS];

        let squared = seen.theta * seen.theta;
        let [k1, k2, k3] = lens.shape;
        let slope = 1.0 + squared * (3.0 * k1 + squared * (5.0 * k2 + squared * 7.0 * k3));
        let bend = seen.theta * (6.0 * k1 + squared * (20.0 * k2 + squared * 42.0 * k3));
        let [a1, a2, a3] = lens.along;
        let cube = squared * seen.theta;
        // Changes of `r(theta)` in focal lengths, and of its slope.
        let changes = [
            (seen.radius, slope),
            (
                cube * (a1 + squared * (a2 + squared * a3)),
                squared * (3.0 * a1 + squared * (5.0 * a2 + squared * 7.0 * a3)),
            ),
            (cube * squared, 5.0 * squared * squared),
        ];
        let sin = seen.ray.x * seen.side[0] + seen.ray.y * seen.side[1];
        let cotangent = seen.ray.z / sin.max(1e-9);
        for (row, (radius, of_slope)) in row.iter_mut().zip(changes) {
            let theta = -radius / slope;
            *row = factor * outward * lens.focal * slope * theta
                - by_outward * (bend * theta + of_slope) / slope
                + by_around * cotangent * theta;
        }

        let pixels = seen.radius * lens.focal;
        let theta_per_pixel = 1.0 / (lens.focal * slope);
        let [x, y] = seen.side;
        // The way of a point relative to the center: outward, and around in radians.
        for (index, away, turn) in [(3, -x, y / pixels), (4, -y, -x / pixels)] {
            let of_outward = -bend * theta_per_pixel / slope * away;
            let of_around = (cotangent * theta_per_pixel - 1.0 / pixels) * away;
            // Turns exchange both parts.
            let turned = theta_per_pixel * cotangent * pixels
                - sin * seen.ray.z / (pixels * theta_per_pixel);
            row[index] = factor * (outward * away + around * turn * pixels)
                + by_outward * of_outward
                + by_around * of_around
                - residual * square * outward * around * turned * turn;
        }

        // The normal turns with the room.
        let turn = normal.cross(&seen.ray) * factor
            - (normal.cross(&seen.outward) * outward + normal.cross(&seen.around) * around)
                * (residual * square);
        row[5..8].copy_from_slice(turn.as_slice());
        Self {
            pixels: residual,
            row,
            own_slope,
        }
    }
}

/// A smooth piece of an edge, without corners.
#[derive(Debug, Clone, PartialEq)]
pub struct EdgeCurve {
    /// Points along the curve in pixel centers, at about the same distance from each other.
    pub points: Vec<[f64; 2]>,
    /// Pixels of the frame per pixel of the raster in which the edge was found. Positions are as
    /// much less exact.
    pub scale: f64,
}

impl EdgeCurve {
    /// The length of the chord in pixels.
    pub(super) fn length(&self) -> f64 {
        match (self.points.first(), self.points.last()) {
            (Some(first), Some(last)) => (last[0] - first[0]).hypot(last[1] - first[1]),
            _ => 0.0,
        }
    }
}

//! The distance of a point from a plane in pixels, and its change with the parameters of a camera.
//!
//! The distance is `F n·u`, with the normal `n`, the ray `u` and `F = 1 / |grad(n·u)|`. The change
//! of `F` counts as well: it is small for each point, but it has the same sign for all of them.
//! Terms of the square of the distance are left out.

use super::{
    camera::{RoomCamera, SeenRay, Shape, ideal_shape_slope},
    evaluation::PARAMETERS,
};
use crate::geometry::Ray;

/// A residual with its slopes.
pub(super) struct Residual {
    /// Signed distance from the plane.
    pub pixels: f64,
    /// Change with each parameter.
    pub row: [f64; PARAMETERS],
    /// Change with the angle of the plane around its direction.
    pub own_slope: f64,
}

/// Values of a camera that all residuals need.
pub(super) struct LensSlopes {
    focal: f64,
    shape: Shape,
    /// Change of the shape with its first coefficient.
    along: Shape,
}

impl LensSlopes {
    pub(super) fn new(camera: &RoomCamera) -> Self {
        Self {
            focal: camera.focal,
            shape: camera.shape(),
            along: ideal_shape_slope(camera.k1),
        }
    }
}

/// Square of the distance in pixels from a plane, per unit of the scalar product with its normal.
pub(super) fn squared_pixels_per_unit(seen: &SeenRay, normal: &Ray) -> f64 {
    let outward = normal.dot(&seen.outward);
    let around = normal.dot(&seen.around);
    1.0 / (outward * outward + around * around).max(1e-14)
}

/// The least of [`squared_pixels_per_unit`] for all rays and normals: `outward` and `around` are
/// orthogonal.
pub(super) fn least_squared_pixels_per_unit(rays: &[SeenRay]) -> f64 {
    let most = rays.iter().map(|seen| {
        let outward = seen.outward.norm_squared();
        outward.max(seen.around.norm_squared())
    });
    1.0 / most.fold(1e-14, f64::max)
}

/// The residual, and its change with the angle of the plane: `turned` is the change of the normal.
pub(super) fn own_slope(seen: &SeenRay, normal: &Ray, turned: &Ray) -> (f64, f64) {
    let square = squared_pixels_per_unit(seen, normal);
    let factor = square.sqrt();
    let residual = factor * normal.dot(&seen.ray);
    let outward = normal.dot(&seen.outward) * turned.dot(&seen.outward);
    let around = normal.dot(&seen.around) * turned.dot(&seen.around);
    let slope = factor * turned.dot(&seen.ray) - residual * square * (outward + around);
    (residual, slope)
}

impl Residual {
    pub(super) fn new(seen: &SeenRay, normal: &Ray, turned: &Ray, lens: &LensSlopes) -> Self {
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

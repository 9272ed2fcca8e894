//! The assumptions before any edge is seen.

use nalgebra::{SMatrix, SVector};

use super::camera::{Angles, RoomCamera, ideal_shape_slope};

/// A lens circle, detected or assumed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircleGuess {
    /// Center in pixels.
    pub center: [f64; 2],
    /// Radius in pixels.
    pub radius: f64,
    /// Standard deviation of the optical center from it, pixels.
    pub center_sigma: f64,
}

/// The assumptions before any curve is seen.
#[derive(Debug, Clone)]
pub(super) struct Prior {
    /// The lens circle. The curve must rise up to its radius.
    pub circle: CircleGuess,
    /// First coefficient of the shape and its standard deviation.
    pub k1: (f64, f64),
    /// Standard deviation of the second coefficient from that of an ideal lens.
    pub k2_sigma: f64,
    /// Angle at the radius and its standard deviation, radians.
    pub rim: (f64, f64),
    /// True for a camera on a ceiling. If false, it may be on a wall.
    pub is_on_ceiling: bool,
}

impl Prior {
    /// Adds the logarithm of the prior and its normal equations.
    pub fn add_to(&self, result: &mut Evaluation, camera: &RoomCamera, angles: &Angles) {
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
            let off = camera.center[axis] - self.circle.center[axis];
            add(&[(3 + axis, 1.0)], off, self.circle.center_sigma);
        }
        add(&[(2, 1.0)], camera.k2_offset, self.k2_sigma);
        add(&[(1, 1.0)], camera.k1 - self.k1.0, self.k1.1);
        let theta = angles.theta(self.circle.radius / camera.focal);
        let (radius, slope) = camera.curve(theta);
        let ideal = ideal_shape_slope(camera.k1);
        let cube = theta.powi(3);
        let rows = [
            (0, -radius / slope),
            (
                1,
                -cube * (ideal[0] + theta * theta * (ideal[1] + theta * theta * ideal[2])) / slope,
            ),
            (2, -cube * theta * theta / slope),
        ];
        add(&rows, theta - self.rim.0, self.rim.1);
        for index in 0..result.right.len() {
            for other in 0..index {
                result.normal[(other, index)] = result.normal[(index, other)];
            }
        }
    }
}

/// The number of parameters: focal length, two of the shape, two of the center, three of the
/// rotation.
pub(super) const PARAMETERS: usize = 8;

/// One number for each parameter.
pub(super) type Parameters = SVector<f64, PARAMETERS>;
/// One number for each pair of parameters.
pub(super) type Normal = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// Evidence, and the normal equations of the parameters.
pub(super) struct Evaluation {
    /// Logarithm of the likelihood ratio, plus that of the prior.
    pub evidence: f64,
    /// Gauss-Newton matrix.
    pub normal: Normal,
    /// Right side.
    pub right: Parameters,
    /// Share of the lengths of all curves that each direction explains.
    pub shares: Vec<f64>,
    /// Explained share of each curve.
    pub explained: Vec<f64>,
}

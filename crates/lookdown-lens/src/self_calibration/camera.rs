//! The camera that is fitted: an odd polynomial, a center, and the directions of the room.

use nalgebra::Rotation3;

use crate::geometry::Ray;
use crate::saturating::to_usize;

/// Largest angle of the table of angles, radians.
const MAX_THETA: f64 = 2.2;
/// Entries of the table of angles.
const ENTRIES: usize = 1024;
/// Least slope of the curve `r(theta)` up to the circle, in focal lengths per radian. A curve that
/// turns back before the circle explains every edge at the rim.
pub(super) const MIN_SLOPE: f64 = 0.02;

/// Angles at which a stretched camera keeps the radius, radians.
const STRETCH_ANGLES: [f64; 2] = [0.6, 1.35];
/// First coefficients of stretched cameras.
const STRETCH_SHAPES: (f64, f64) = (-0.2, 0.2);

/// Coefficients of `r = f (theta + k1 theta^3 + k2 theta^5 + k3 theta^7)`.
pub(super) type Shape = [f64; 3];

/// The shape of an ideal lens with this first coefficient: `f sin(q theta) / q` below zero,
/// `f tan(q theta) / q` above. Equidistant, equisolid, stereographic and orthographic lenses are
/// among them.
pub(super) fn ideal_shape(k1: f64) -> Shape {
    let (square, cube) = (k1 * k1, k1 * k1 * k1);
    if k1 < 0.0 {
        [k1, 0.3 * square, 3.0 / 70.0 * cube]
    } else {
        [k1, 1.2 * square, 51.0 / 35.0 * cube]
    }
}

/// The derivative of [`ideal_shape`] to its first coefficient.
pub(super) fn ideal_shape_slope(k1: f64) -> Shape {
    if k1 < 0.0 {
        [1.0, 0.6 * k1, 9.0 / 70.0 * k1 * k1]
    } else {
        [1.0, 2.4 * k1, 153.0 / 35.0 * k1 * k1]
    }
}

/// A camera in a room of straight edges.
#[derive(Debug, Clone)]
pub(super) struct RoomCamera {
    /// Focal length in pixels.
    pub focal: f64,
    /// First coefficient of the shape.
    pub k1: f64,
    /// Difference of the second coefficient from that of the ideal shape.
    pub k2_offset: f64,
    /// Center in pixels.
    pub center: [f64; 2],
    /// Camera from room: the third axis of the room is the vertical.
    pub room: Rotation3<f64>,
}

/// A ray and what it changes with.
#[derive(Debug, Clone, Copy)]
pub(super) struct SeenRay {
    /// The unit vector.
    pub ray: Ray,
    /// Its change per pixel away from the center.
    pub outward: Ray,
    /// Its change per pixel around the center.
    pub around: Ray,
    /// Direction in the image from the center, a unit vector.
    pub side: [f64; 2],
    /// Angle from the axis.
    pub theta: f64,
    /// Distance from the center in focal lengths.
    pub radius: f64,
}

impl RoomCamera {
    pub(super) fn shape(&self) -> Shape {
        let mut shape = ideal_shape(self.k1);
        shape[1] += self.k2_offset;
        shape
    }

    /// Radius in focal lengths, and its slope.
    pub(super) fn curve(&self, theta: f64) -> (f64, f64) {
        curve(self.shape(), theta)
    }

    /// The angle at a radius in pixels, or `None` where the curve turns back before.
    pub(super) fn theta(&self, radius: f64) -> Option<f64> {
        Angles::from_camera(self, radius).map(|angles| angles.theta(radius / self.focal))
    }

    /// A camera that sees nearly the same edges straight in a room whose height, along the axis, is
    /// multiplied, or `None` if no lens of the family does.
    pub(super) fn stretched(&self, share: f64) -> Option<Self> {
        let [near, far] = STRETCH_ANGLES.map(|theta| self.curve((theta.tan() * share).atan()).0);
        let ratio = |k1: f64| {
            let [near, far] = STRETCH_ANGLES.map(|theta| curve(ideal_shape(k1), theta).0);
            far / near
        };
        let (mut low, mut high) = STRETCH_SHAPES;
        if !(ratio(low)..ratio(high)).contains(&(far / near)) {
            return None;
        }
        for _ in 0..30 {
            let middle = f64::midpoint(low, high);
            if ratio(middle) < far / near {
                low = middle;
            } else {
                high = middle;
            }
        }
        let scale = near / curve(ideal_shape(low), STRETCH_ANGLES[0]).0;
        Some(Self {
            focal: self.focal * scale,
            k1: low,
            k2_offset: 0.0,
            ..self.clone()
        })
    }

    /// The directions of edges: the vertical, then the two horizontal ones.
    pub(super) fn directions(&self) -> [Ray; 3] {
        [Ray::z(), Ray::x(), Ray::y()].map(|axis| self.room * axis)
    }
}

/// The radius of a shape in focal lengths, `theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6)`, and
/// its slope.
pub(super) fn curve([k1, k2, k3]: Shape, theta: f64) -> (f64, f64) {
    let square = theta * theta;
    let radius = theta * (1.0 + square * (k1 + square * (k2 + square * k3)));
    let slope = 1.0 + square * (3.0 * k1 + square * (5.0 * k2 + square * 7.0 * k3));
    (radius, slope)
}

/// Table of the angles of a camera.
#[derive(Debug)]
pub(super) struct Angles {
    shape: Shape,
    thetas: Vec<f64>,
    entries_per_focal: f64,
}

impl Angles {
    /// The table up to a radius in pixels, or `None` if the curve does not rise up to there.
    pub(super) fn from_camera(camera: &RoomCamera, radius: f64) -> Option<Self> {
        let shape = camera.shape();
        let end = radius / camera.focal;
        let mut thetas = Vec::with_capacity(ENTRIES + 2);
        let mut theta = 0.0_f64;
        for entry in 0..ENTRIES + 2 {
            let target = end * entry as f64 / ENTRIES as f64;
            for _ in 0..2 {
                let (value, slope) = curve(shape, theta);
                if slope < MIN_SLOPE {
                    return None;
                }
                theta += (target - value) / slope;
            }
            if !(0.0..MAX_THETA).contains(&theta.max(0.0)) {
                return None;
            }
            thetas.push(theta);
        }
        let entries_per_focal = ENTRIES as f64 / end;
        Some(Self {
            shape,
            thetas,
            entries_per_focal,
        })
    }

    /// The angle at a radius in focal lengths: linear between the entries, then one step of Newton.
    pub(super) fn theta(&self, radius: f64) -> f64 {
        let at = radius * self.entries_per_focal;
        let entry = to_usize(at).min(self.thetas.len() - 2);
        let share = (at - entry as f64).min(1.0);
        let theta = self.thetas[entry] + share * (self.thetas[entry + 1] - self.thetas[entry]);
        let (value, slope) = curve(self.shape, theta);
        theta + (radius - value) / slope.max(MIN_SLOPE)
    }

    /// The ray of a pixel.
    pub(super) fn ray(&self, camera: &RoomCamera, [x, y]: [f64; 2]) -> SeenRay {
        let [x, y] = [x - camera.center[0], y - camera.center[1]];
        let pixels = (x * x + y * y).sqrt().max(1e-6);
        let side = [x / pixels, y / pixels];
        let radius = pixels / camera.focal;
        let theta = self.theta(radius);
        let (sin, cos) = theta.sin_cos();
        let (_, slope) = curve(self.shape, theta);
        let theta_per_pixel = 1.0 / (camera.focal * slope.max(MIN_SLOPE));
        let (out, down) = (cos * theta_per_pixel, -sin * theta_per_pixel);
        let around_per_pixel = sin / pixels;
        SeenRay {
            ray: Ray::new(sin * side[0], sin * side[1], cos),
            outward: Ray::new(out * side[0], out * side[1], down),
            around: Ray::new(-around_per_pixel * side[1], around_per_pixel * side[0], 0.0),
            side,
            theta,
            radius,
        }
    }
}

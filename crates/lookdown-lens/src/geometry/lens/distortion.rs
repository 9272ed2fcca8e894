//! Radial and tangential distortion in the normalized image plane.

use super::{LensError, error::finite, inversion::rising_root};

/// Bound on Newton steps in the plane; a handful suffice from the radial solution.
const MAX_STEPS: usize = 32;
/// The largest residual of an inverse, relative to the distance from the axis.
const RESIDUAL_TOLERANCE: f64 = 1e-10;

/// `x (1 + k1 r² + k2 r⁴) + 2 p1 x y + p2 (r² + 2 x²)`, and for `y` likewise with `p1`, `p2`
/// exchanged (Brown 1966, in OpenCV's order of the coefficients).
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(missing_docs, reason = "the coefficients of the formula above")]
pub struct RadialTangential {
    pub k1: f64,
    pub k2: f64,
    pub p1: f64,
    pub p2: f64,
}

impl RadialTangential {
    pub(super) fn check(&self) -> Result<(), LensError> {
        let named = [
            ("k1", self.k1),
            ("k2", self.k2),
            ("p1", self.p1),
            ("p2", self.p2),
        ];
        named
            .into_iter()
            .try_for_each(|(name, value)| finite(name, value).map(drop))
    }

    /// Returns true when every azimuth is distorted alike.
    pub(super) fn is_radial(&self) -> bool {
        self.p1 == 0.0 && self.p2 == 0.0
    }

    pub(super) fn distort(&self, x: f64, y: f64) -> (f64, f64) {
        let square = x * x + y * y;
        let radial = 1.0 + square * (self.k1 + square * self.k2);
        (
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (square + 2.0 * x * x),
            y * radial + 2.0 * self.p2 * x * y + self.p1 * (square + 2.0 * y * y),
        )
    }

    /// Returns the stretch of a step outward at `radius`, in the azimuth in which that is least.
    /// While it is positive the distortion is one-to-one: its Jacobian is symmetric, and against
    /// the vector (p2, p1) its radial eigenvalue is the derivative of the radial part less
    /// `6 |p| r`.
    pub(super) fn least_stretch(&self, radius: f64) -> f64 {
        self.radial_slope(radius) - 6.0 * self.p1.hypot(self.p2) * radius
    }

    fn radial_slope(&self, radius: f64) -> f64 {
        let square = radius * radius;
        1.0 + square * (3.0 * self.k1 + square * 5.0 * self.k2)
    }

    /// The point within `max_radius` that is distorted to (`x`, `y`), if there is one.
    pub(super) fn undistort(&self, x: f64, y: f64, max_radius: f64) -> Option<(f64, f64)> {
        let distance = x.hypot(y);
        // Also where (x, y) is not a number.
        let is_off_axis = distance > 0.0 && distance.is_finite();
        if !is_off_axis {
            return (distance == 0.0).then_some((0.0, 0.0));
        }
        let radial = |r: f64| r * (1.0 + r * r * (self.k1 + r * r * self.k2));
        let curve = |r: f64| (radial(r), self.radial_slope(r));
        let start = distance.min(max_radius);
        let radius = rising_root(curve, distance, (0.0, max_radius), start);
        let (mut u, mut v) = (x * radius / distance, y * radius / distance);
        for _ in 0..MAX_STEPS {
            let (found_x, found_y) = self.distort(u, v);
            let (excess_x, excess_y) = (found_x - x, found_y - y);
            if excess_x.hypot(excess_y) <= f64::EPSILON * distance {
                break;
            }
            let (along_x, mixed, along_y) = self.jacobian(u, v);
            let determinant = along_x * along_y - mixed * mixed;
            u -= (along_y * excess_x - mixed * excess_y) / determinant;
            v -= (along_x * excess_y - mixed * excess_x) / determinant;
        }
        // Where the distortion folds, rounding carries the solution a little beyond the rim.
        let inward = (max_radius / u.hypot(v)).min(1.0);
        let (u, v) = (u * inward, v * inward);
        let (found_x, found_y) = self.distort(u, v);
        let residual = (found_x - x).hypot(found_y - y);
        (residual <= RESIDUAL_TOLERANCE * distance).then_some((u, v))
    }

    /// The derivatives du/dx, du/dy (which is dv/dx) and dv/dy.
    fn jacobian(&self, x: f64, y: f64) -> (f64, f64, f64) {
        let square = x * x + y * y;
        let radial = 1.0 + square * (self.k1 + square * self.k2);
        let growth = 2.0 * (self.k1 + 2.0 * square * self.k2);
        (
            radial + x * x * growth + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            x * y * growth + 2.0 * (self.p1 * x + self.p2 * y),
            radial + y * y * growth + 2.0 * self.p2 * x + 6.0 * self.p1 * y,
        )
    }
}

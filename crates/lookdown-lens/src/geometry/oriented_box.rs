//! Boxes whose height axis follows the projected vertical: how people stand in a fisheye frame.
//! That of someone who lies follows the body.

use nalgebra::{Matrix2, SymmetricEigen, Vector2};

use super::{Lens, Mount, Pixel, pixels::to_pixel_center};

/// Step along the vertical, in units of the ray, for the direction of up in the frame.
const VERTICAL_STEP: f64 = 1e-4;
/// The most correlation of the extents along and across a box of who lies: a body is thicker than a
/// line.
const MOST_TILT: f64 = 0.9;

/// A rectangle in the frame, turned so that its height axis is the projected vertical or a body's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientedBox {
    /// Center, corner-origin frame pixels.
    pub center: Pixel,
    /// Extent across the height axis, pixels.
    pub width: f64,
    /// Extent along the height axis, pixels.
    pub height: f64,
    /// Clockwise rotation of the height axis from image up, radians, in (−π/2, π/2].
    pub angle: f64,
    /// Unit vector of the height axis, from the feet to the head.
    pub up: Vector2<f64>,
}

impl OrientedBox {
    /// The box of these extents whose height axis is turned clockwise from image up by `angle`,
    /// radians; its head is at the upper end, which the axis alone leaves open.
    pub fn turned(center: Pixel, width: f64, height: f64, angle: f64) -> Self {
        Self {
            center,
            width,
            height,
            angle,
            up: Vector2::new(angle.sin(), -angle.cos()),
        }
    }

    /// Returns the box with its head at the end of its axis that is nearer to `vertical`, a
    /// direction in the frame.
    pub fn with_head_toward(&self, vertical: &Vector2<f64>) -> Self {
        let is_turned = self.up.dot(vertical) < 0.0;
        let up = if is_turned { -self.up } else { self.up };
        Self { up, ..*self }
    }

    /// Returns the box around the inscribed ellipse with its height axis along `vertical`, a
    /// direction in the frame of any length.
    pub fn along(&self, vertical: &Vector2<f64>) -> Self {
        let up = vertical.try_normalize(f64::EPSILON).unwrap_or(self.up);
        let axes = [self.up * self.height, across(self.up) * self.width];
        let extent = |axis: Vector2<f64>| axes[0].dot(&axis).hypot(axes[1].dot(&axis));
        Self {
            center: self.center,
            width: extent(across(up)),
            height: extent(up),
            angle: axis_angle(up),
            up,
        }
    }

    /// Returns the box along the longer axis of an ellipse that touches the sides of this box, and
    /// those of other boxes as nearly as possible.
    ///
    /// Each of the other boxes has two `widths`: vectors across opposite sides, as long as these
    /// are apart, in pixels, with a weight. The half width of an ellipse with the
    /// matrix `M` in the direction `n` is `√(nᵀ M n)` (Boyd and Vandenberghe, Convex Optimization,
    /// 2004, section 3.2.3, support functions). In the axes of this box, its own sides give the
    /// diagonal of `M`, and the widths give the rest by linear least squares.
    pub fn tilted_to_widths(&self, widths: &[(f64, Vector2<f64>)]) -> Self {
        let axes = Matrix2::from_columns(&[self.up, across(self.up)]);
        let [along2, across2] = [self.height, self.width].map(|extent| extent * extent / 4.0);
        let (mut sum, mut squares) = (0.0, 0.0);
        for (weight, width) in widths {
            // The share of each term of nᵀ M n in the squared half width.
            let normal = axes.tr_mul(width) * (2.0 / width.norm_squared().max(1.0));
            let tilt = 2.0 * normal.x * normal.y;
            let rest = normal.x.powi(2) * along2 + normal.y.powi(2) * across2;
            sum += weight * tilt * (1.0 - rest);
            squares += weight * tilt.powi(2);
        }
        let most = MOST_TILT * (along2 * across2).sqrt();
        let tilt = (sum / squares.max(f64::MIN_POSITIVE)).clamp(-most, most);
        let ellipse = SymmetricEigen::new(Matrix2::new(along2, tilt, tilt, across2));
        let long = ellipse.eigenvalues.imax();
        let extent = |axis: usize| 2.0 * ellipse.eigenvalues[axis].max(0.0).sqrt();
        let up = axes * ellipse.eigenvectors.column(long);
        Self {
            center: self.center,
            width: extent(1 - long),
            height: extent(long),
            angle: axis_angle(up),
            up,
        }
        .with_head_toward(&self.up)
    }

    /// Returns the box in the same frame `factor` times as large.
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            center: self.center * factor,
            width: self.width * factor,
            height: self.height * factor,
            ..*self
        }
    }

    /// Returns the corners, clockwise from the upper left one at no rotation, corner-origin frame
    /// pixels.
    pub fn corners(&self) -> [Pixel; 4] {
        let (sin, cos) = self.angle.sin_cos();
        let right = Vector2::new(cos, sin) * (0.5 * self.width);
        let down = Vector2::new(-sin, cos) * (0.5 * self.height);
        [-right - down, right - down, right + down, down - right].map(|to| self.center + to)
    }

    /// The middle of the lower short side: where the feet are. Corner-origin frame pixels.
    pub fn foot(&self) -> Pixel {
        self.center - self.up * (self.height / 2.0)
    }

    /// The box with the same axis whose inscribed ellipse has the bounds `[x_min, y_min, x_max,
    /// y_max]` (corner-origin frame pixels) as nearly as the axis allows.
    ///
    /// With the semi-axes `p` along and `q` across an axis at the angle `a` from a side, the half
    /// extents `w`, `h` of the bounds fulfil `p² + q² = w² + h²`, always, and
    /// `(p² − q²) cos(2a) = h² − w²`, which says nothing at 45°. So the sum is taken from the
    /// bounds, and the difference from the bounds in the share `cos²(2a)` and from this box's own
    /// proportions in the rest. `docs/geometry.md` has the derivation.
    pub fn fitted_to(&self, [x_min, y_min, x_max, y_max]: [f64; 4]) -> Self {
        let (half_width, half_height) = ((x_max - x_min) / 2.0, (y_max - y_min) / 2.0);
        let (w2, h2) = (half_width.powi(2), half_height.powi(2));
        let sum = w2 + h2;
        let cos2 = self.up.y.powi(2) - self.up.x.powi(2);
        let (along2, across2) = (self.height.powi(2), self.width.powi(2));
        let proportion = (along2 - across2) / (along2 + across2);
        let own = if proportion.is_finite() {
            proportion * sum
        } else {
            0.0
        };
        // cos²(2a) · (h² − w²) / cos(2a), without the division.
        let difference = own * (1.0 - cos2.powi(2)) + cos2 * (h2 - w2);
        // No thinner than the own proportions or the bounds make it.
        let difference = difference.clamp(-sum, sum);
        Self {
            center: Pixel::new(f64::midpoint(x_min, x_max), f64::midpoint(y_min, y_max)),
            width: 2.0 * f64::midpoint(sum, -difference).max(0.0).sqrt(),
            height: 2.0 * f64::midpoint(sum, difference).max(0.0).sqrt(),
            ..*self
        }
    }

    /// The box with its height axis along `up` that averages the extents of several outlines.
    /// Weights must be positive; `None` without outlines.
    pub fn averaging<'a>(
        up: Vector2<f64>,
        weighted_outlines: impl IntoIterator<Item = (f64, &'a [Pixel])>,
    ) -> Option<Self> {
        let right = across(up);
        let mut total = 0.0;
        let mut extents = [0.0; 4];
        for (weight, outline) in weighted_outlines {
            let (low, high) = extent(outline, &up)?;
            let (left_end, right_end) = extent(outline, &right)?;
            total += weight;
            for (sum, value) in extents.iter_mut().zip([low, high, left_end, right_end]) {
                *sum += weight * value;
            }
        }
        if total <= 0.0 {
            return None;
        }
        let [low, high, left_end, right_end] = extents.map(|sum| sum / total);
        let center = up * f64::midpoint(low, high) + right * f64::midpoint(left_end, right_end);
        Some(Self {
            center: Pixel::from(center),
            width: right_end - left_end,
            height: high - low,
            angle: axis_angle(up),
            up,
        })
    }
}

/// The direction (unit length, frame pixels) in which a vertical pole seen at `point`
/// (corner-origin) rises; image up where the camera looks along the vertical.
pub fn vertical_in_frame(point: Pixel, lens: &Lens, mount: &Mount) -> Vector2<f64> {
    let image_up = Vector2::new(0.0, -1.0);
    let pixel = to_pixel_center(point);
    let Some(ray) = lens.unproject(&pixel) else {
        return image_up;
    };
    let step = mount.world_up() * VERTICAL_STEP;
    let (Some(below), Some(above)) = (
        lens.project_to_rim(&(ray - step)),
        lens.project_to_rim(&(ray + step)),
    ) else {
        return image_up;
    };
    (above - below)
        .try_normalize(f64::EPSILON)
        .unwrap_or(image_up)
}

/// A direction turned clockwise by a quarter.
fn across(direction: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-direction.y, direction.x)
}

fn extent(outline: &[Pixel], axis: &Vector2<f64>) -> Option<(f64, f64)> {
    outline
        .iter()
        .map(|point| point.coords.dot(axis))
        .map(|along| (along, along))
        .reduce(|(low, high), (along, _)| (low.min(along), high.max(along)))
}

/// The clockwise angle of an axis from image up, radians, in (−π/2, π/2]: an axis has no sign.
fn axis_angle(up: Vector2<f64>) -> f64 {
    let angle = up.x.atan2(-up.y);
    if angle > std::f64::consts::FRAC_PI_2 {
        angle - std::f64::consts::PI
    } else if angle <= -std::f64::consts::FRAC_PI_2 {
        angle + std::f64::consts::PI
    } else {
        angle
    }
}

#[cfg(test)]
mod tests;

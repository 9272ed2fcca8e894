//! The sides of boxes: `[x_min, y_min, x_max, y_max]`.

use super::Pixel;

/// Returns the smallest box that holds two boxes.
pub fn hull(one: [f64; 4], other: [f64; 4]) -> [f64; 4] {
    [
        one[0].min(other[0]),
        one[1].min(other[1]),
        one[2].max(other[2]),
        one[3].max(other[3]),
    ]
}

/// Returns the middle of a box.
pub fn middle([x_min, y_min, x_max, y_max]: [f64; 4]) -> Pixel {
    Pixel::new(f64::midpoint(x_min, x_max), f64::midpoint(y_min, y_max))
}

//! The one place where pixel-center coordinates (lens functions, tables) and corner-origin
//! coordinates (boxes) meet.

use super::Pixel;

/// Half a pixel: the center of pixel `i` lies at `i` for a lens and at `i + 0.5` for a box.
const HALF_PIXEL: f64 = 0.5;

/// Returns a point of a box, a data set or a file (pixel `i` covers `[i, i + 1)`) as a point of a
/// lens or a remap table (the center of pixel `i` is at `i`).
pub fn to_pixel_center(point: Pixel) -> Pixel {
    Pixel::new(point.x - HALF_PIXEL, point.y - HALF_PIXEL)
}

/// Returns a point of a lens or a remap table as a point of a box, a data set or a file.
pub fn to_corner_origin(point: Pixel) -> Pixel {
    Pixel::new(point.x + HALF_PIXEL, point.y + HALF_PIXEL)
}

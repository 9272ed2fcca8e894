//! The one place where pixel-center coordinates (lens functions, tables) and corner-origin
//! coordinates (boxes) meet.

use super::Pixel;

/// Half a pixel: the center of pixel `i` lies at `i` for a lens and at `i + 0.5` for a box.
const HALF_PIXEL: f64 = 0.5;

/// The two conventions for where pixel `i` lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PixelConvention {
    /// Pixel `i` covers `[i, i + 1)`: boxes in reports, data sets and files.
    CornerOrigin,
    /// The center of pixel `i` is at `i`: `project`, `cx`, `cy`, remap tables.
    PixelCenter,
}

/// Crosses the half pixel: `point` is given in the other convention and returned in `target`.
pub fn cross_half_pixel(point: Pixel, target: PixelConvention) -> Pixel {
    let shift = match target {
        PixelConvention::CornerOrigin => HALF_PIXEL,
        PixelConvention::PixelCenter => -HALF_PIXEL,
    };
    Pixel::new(point.x + shift, point.y + shift)
}

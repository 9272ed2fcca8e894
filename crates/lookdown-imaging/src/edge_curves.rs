//! Smooth edges of a frame with subpixel positions, for the fit of its camera.
//!
//! 1. Gradient of the smoothed luminance (`gradient`).
//! 2. Maxima across the edge are linked to chains, whose positions are interpolated (`chains`).
//! 3. Chains are split at corners into pieces that a parabola describes (`pieces`). The image of a
//!    straight edge in a fisheye frame is such a piece.

mod chains;
mod gradient;
mod pieces;
mod plane;
mod surround;

use lookdown_lens::self_calibration::EdgeCurve;

use super::{frame::Frame, lens_circle::LensCircle};
use gradient::Gradient;
use plane::Plane;

/// Rasters with a shorter side have no edges of a room.
const MIN_SIDE: u32 = 32;
/// Longer sides are halved, or divided by three, and so on.
const MAX_SIDE: u32 = 1700;
/// Rasters in which edges are found: the finest, then each of half of the sides before.
pub(super) const RASTERS: usize = 3;
/// Share of the radius that is used: the rim itself is an edge, too.
pub(super) const USED_RADIUS: f64 = 0.975;

/// Returns the smooth edges inside a circle, in pixel centers of the frame: those of the finest
/// raster first.
pub fn edge_curves(frame: &Frame, circle: &LensCircle) -> [Vec<EdgeCurve>; RASTERS] {
    let finest = frame.width().max(frame.height()).div_ceil(MAX_SIDE);
    std::array::from_fn(|raster| curves_of_raster(frame, circle, finest << raster))
}

/// The edges of a frame whose sides are divided.
fn curves_of_raster(frame: &Frame, circle: &LensCircle, divisor: u32) -> Vec<EdgeCurve> {
    if frame.width().min(frame.height()) / divisor < MIN_SIDE {
        return Vec::new();
    }
    let luminance = Plane::luminance(frame, divisor);
    let surround = surround::mask(frame, divisor);
    let gradient = Gradient::new(&luminance);
    let scale = f64::from(divisor);
    // The center of the first pixel of the smaller plane.
    let origin = (scale - 1.0) / 2.0;
    let in_frame = |[x, y]: [f64; 2]| [x * scale + origin, y * scale + origin];
    let is_used = |point: [f64; 2]| {
        let [x, y] = in_frame(point);
        (x - circle.cx).hypot(y - circle.cy) < USED_RADIUS * circle.radius
            && !surround.contains(point)
    };
    let mut curves = Vec::new();
    for chain in chains::linked(&gradient, &is_used) {
        for piece in pieces::smooth(&chain) {
            let points = pieces::supports(piece).into_iter().map(in_frame).collect();
            curves.push(EdgeCurve { points, scale });
        }
    }
    curves
}

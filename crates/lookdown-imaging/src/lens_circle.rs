//! Detection of the lens image in a fisheye frame: a bright disc on a black surround.
//!
//! 1. The corners give the brightness of the surround (`surround`).
//! 2. Scans along rows and columns, from the border inward, reach the disc. A consensus circle
//!    through those points ignores captions and unlit parts of the room (`outline`, `consensus`).
//! 3. Along rays near that circle the rim is located to a fraction of a pixel, and a robust
//!    least-squares circle is fitted to it (`rim`, `least_squares`).

mod agreement;
mod circle;
mod consensus;
mod least_squares;
mod outline;
mod rim;
mod surround;

use std::f64::consts::TAU;

use super::frame::Frame;
pub use agreement::{AgreedCircle, agreed_circle};
pub use circle::LensCircle;
use rim::RimPoint;
use surround::Surround;

/// Frames with a shorter side below this show too little of a rim to measure.
const MIN_SIDE: u32 = 32;
/// Least contrast between lens image and surround, relative to the brightness of the frame's
/// center. The first value ignores stray light around the lens image. The second is for lenses that
/// darken toward the rim.
const MIN_CONTRASTS: [f64; 2] = [0.1, 0.03];
/// Search range for the rim on either side of the current circle, in radii. The first is wide, to
/// recover from a rough consensus.
const REACHES: [f64; 3] = [0.04, 0.02, 0.02];
/// A smaller circle is a lamp or a table.
const MIN_RADIUS_IN_SHORT_SIDES: f64 = 0.25;
/// Share of the rays meeting the circle inside the frame that must show a rim. The others may show
/// a dark part of the room.
const MIN_SUPPORT: f64 = 0.35;
/// Farthest middle of a circle from that of its half of a frame of two lenses.
const MAX_OFFSET_IN_RADII: f64 = 0.25;
/// The widest angle without any rim. Beyond it, center and radius are ambiguous.
const MAX_GAP_RADIANS: f64 = 3.5;

/// Finds the lens circle to a fraction of a pixel. The frame may cut it off.
///
/// Returns `None` where no dark surround shows it: in a frame filled by the lens image, an image of
/// an ordinary camera, or a dark room. Use [`assumed_circle`] then. The result is deterministic.
pub fn find_lens_circle(frame: &Frame) -> Option<LensCircle> {
    if short_side(frame) < MIN_SIDE {
        return None;
    }
    MIN_CONTRASTS
        .into_iter()
        .find_map(|min_contrast| find_at_contrast(frame, min_contrast))
}

fn find_at_contrast(frame: &Frame, min_contrast: f64) -> Option<LensCircle> {
    let surround = Surround::new(frame, min_contrast)?;
    let mut circle = consensus::circle(&outline::points(frame, &surround))?;
    let mut edge = Vec::new();
    for reach in REACHES {
        edge = rim::points(frame, &surround, &circle, reach);
        let points: Vec<_> = edge.iter().map(|point| point.at).collect();
        circle = least_squares::circle(&points, &circle)?;
    }
    let is_large = circle.radius >= MIN_RADIUS_IN_SHORT_SIDES * f64::from(short_side(frame));
    (is_large && is_shown(&edge, frame, &circle)).then_some(circle)
}

/// Brightness (0 to 255) above which a pixel is lens image, or `None` in a frame without a dark
/// surround.
pub fn surround_threshold(frame: &Frame) -> Option<f64> {
    if short_side(frame) < MIN_SIDE {
        return None;
    }
    let surround = Surround::new(frame, MIN_CONTRASTS[1])?;
    Some(surround.threshold)
}

fn short_side(frame: &Frame) -> u32 {
    frame.width().min(frame.height())
}

/// Returns true if enough of the circle's rim was found, all around it.
fn is_shown(edge: &[RimPoint], frame: &Frame, circle: &LensCircle) -> bool {
    let shown: Vec<f64> = edge
        .iter()
        .filter(|point| circle.distance(point.at).abs() <= circle.tolerance())
        .map(|point| point.angle)
        .collect();
    let next_round = shown.first().map(|first| first + TAU);
    let widest_gap = shown
        .iter()
        .zip(shown.iter().skip(1).chain(&next_round))
        .map(|(angle, next)| next - angle)
        .fold(0.0, f64::max);
    let visible = rim::visible_rays(frame, circle);
    let is_supported = shown.len() as f64 >= MIN_SUPPORT * visible as f64;
    !shown.is_empty() && is_supported && widest_gap <= MAX_GAP_RADIANS
}

/// Returns true for a frame of two lenses, beside or above each other: each half has a lens circle
/// in its middle. The halves of one lens circle have its middle at their edge.
pub fn shows_two_circles(frame: &Frame) -> bool {
    let (width, height) = (frame.width(), frame.height());
    let halves = if 2 * width >= 3 * height {
        let middle = width / 2;
        [(0..middle, 0..height), (middle..width, 0..height)]
    } else if 2 * height >= 3 * width {
        let middle = height / 2;
        [(0..width, 0..middle), (0..width, middle..height)]
    } else {
        return false;
    };
    halves.into_iter().all(|(columns, rows)| {
        let Ok(half) = frame.crop(columns, rows) else {
            return false;
        };
        let middle = assumed_circle(half.width(), half.height());
        find_lens_circle(&half).is_some_and(|circle| {
            let offset = (circle.cx - middle.cx).hypot(circle.cy - middle.cy);
            offset <= MAX_OFFSET_IN_RADII * middle.radius
        })
    })
}

/// The largest circle in the center of a frame of this size. It is the guess for frames without a
/// detected circle.
pub fn assumed_circle(width: u32, height: u32) -> LensCircle {
    LensCircle {
        cx: (f64::from(width) - 1.0) / 2.0,
        cy: (f64::from(height) - 1.0) / 2.0,
        radius: f64::from(width.min(height)) / 2.0,
    }
}

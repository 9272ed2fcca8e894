//! Sizes, colors and limits of everything that is drawn.

use super::canvas::Rgb;
use crate::frame::Frame;

pub(super) const INK: Rgb = [12, 14, 18];

/// Far outside any frame, and small enough for exact distances.
pub(super) const MAX_COORDINATE: f64 = 1e6;

pub(super) fn is_drawable(line: &[[f64; 2]]) -> bool {
    let mut coordinates = line.iter().flatten();
    // NaN fails every comparison.
    coordinates.all(|coordinate| coordinate.abs() <= MAX_COORDINATE)
}

/// Width of the main outline in pixels: a 450th of the shorter side, with a visible minimum.
pub(super) fn line_width(frame: &Frame) -> f64 {
    (shorter_side(frame) / 450.0).max(1.6)
}

/// Height of a line of text in pixels: a 48th of the shorter side, with a legible minimum.
pub(super) fn text_height(frame: &Frame) -> f64 {
    (shorter_side(frame) / 48.0).max(12.0)
}

pub(super) fn shorter_side(frame: &Frame) -> f64 {
    f64::from(frame.width().min(frame.height()))
}

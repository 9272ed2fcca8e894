//! Brightness of the surround of the lens image, and the threshold above it.

use std::ops::Range;

use crate::frame::Frame;

/// A corner brighter than this (of 255) is lens image, not surround.
const MAX_LEVEL: f64 = 80.0;
/// The least step from surround to lens image that exceeds compression noise.
const MIN_STEP: f64 = 6.0;
/// Least step in interquartile ranges of the surround's own noise.
const STEP_IN_NOISE: f64 = 3.0;

/// Brightness of the surround.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surround {
    /// The surround's brightness, 0 to 255.
    pub level: f64,
    /// Brighter values are not surround.
    pub threshold: f64,
}

/// The strongest of the three channels. A saturated blue wall is dark in luma, but not black.
pub(super) fn brightness([red, green, blue]: [u8; 3]) -> u8 {
    red.max(green).max(blue)
}

/// Pixels along the frame's border that are ignored, because some recorders draw a thin border.
pub(super) fn margin(frame: &Frame) -> u32 {
    frame.width().min(frame.height()) / 100
}

impl Surround {
    /// Measures the four corners and uses the darkest and least noisy one, since a caption may
    /// cover the others. Returns `None` when even that corner is too bright to be a surround.
    ///
    /// `min_contrast` (0 to 1) is the least contrast between lens image and surround, relative to
    /// the brightness of the frame's center.
    pub(super) fn new(frame: &Frame, min_contrast: f64) -> Option<Self> {
        let (width, height) = (frame.width(), frame.height());
        let margin = margin(frame);
        let side = (width.min(height) / 32).max(4);
        let near = margin..margin + side;
        let far = |length: u32| length - margin - side..length - margin;
        let corners = [
            (near.clone(), near.clone()),
            (far(width), near.clone()),
            (near, far(height)),
            (far(width), far(height)),
        ];
        let half = |length: u32| length / 4..length * 3 / 4;
        let (middle, _) = level_and_spread(frame, half(width), half(height));
        corners
            .into_iter()
            .map(|(columns, rows)| {
                let (level, spread) = level_and_spread(frame, columns, rows);
                let step = MIN_STEP
                    .max(STEP_IN_NOISE * spread)
                    .max(min_contrast * (middle - level));
                Self {
                    level,
                    threshold: level + step,
                }
            })
            .min_by(|a, b| a.threshold.total_cmp(&b.threshold))
            .filter(|surround| surround.level <= MAX_LEVEL)
    }
}

/// Median and interquartile range of the brightness in a rectangle, from some thousand of its
/// pixels.
fn level_and_spread(frame: &Frame, columns: Range<u32>, rows: Range<u32>) -> (f64, f64) {
    let sparse = |range: Range<u32>| {
        let step = range.len() / 64 + 1;
        range.step_by(step)
    };
    let mut values: Vec<u8> = sparse(rows)
        .flat_map(|y| sparse(columns.clone()).map(move |x| brightness(frame.pixel(x, y))))
        .collect();
    values.sort_unstable();
    let quantile = |quarters: usize| f64::from(values[(values.len() - 1) * quarters / 4]);
    (quantile(2), quantile(3) - quantile(1))
}

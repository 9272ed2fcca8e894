//! How dark the surround of the lens image is, and what counts as brighter than it.

use crate::imaging::frame::Frame;

/// A corner brighter than this (of 255) is picture, not surround.
const MAX_LEVEL: f64 = 80.0;
/// The least step from surround to picture that is told from noise.
const MIN_STEP: f64 = 8.0;
/// Steps are also at least this many interquartile ranges of the surround's noise.
const STEP_IN_NOISE: f64 = 3.0;

/// Brightness of the surround.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surround {
    /// The surround's brightness, 0 to 255.
    pub level: f64,
    /// What is brighter than this is not surround.
    pub threshold: f64,
}

/// The strongest of the three channels: a saturated blue wall is dark in luma, but it is
/// not black.
pub(super) fn brightness([red, green, blue]: [u8; 3]) -> u8 {
    red.max(green).max(blue)
}

/// Pixels along the frame's border that are ignored: some recorders draw a thin frame.
pub(super) fn margin(frame: &Frame) -> u32 {
    frame.width().min(frame.height()) / 100
}

impl Surround {
    /// Measures the four corners and takes the darkest, since a caption may cover the
    /// others. `None` when even that one is too bright to be a surround.
    pub(super) fn of(frame: &Frame) -> Option<Self> {
        let (width, height) = (frame.width(), frame.height());
        let margin = margin(frame);
        let patch = (width.min(height) / 32).max(4);
        let far = |side: u32| side - margin - patch;
        let corners = [
            (margin, margin),
            (far(width), margin),
            (margin, far(height)),
            (far(width), far(height)),
        ];
        let (level, spread) = corners
            .map(|(left, top)| level_and_spread(frame, left, top, patch))
            .into_iter()
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        (level <= MAX_LEVEL).then(|| Self {
            level,
            threshold: level + MIN_STEP.max(STEP_IN_NOISE * spread),
        })
    }
}

/// Median and interquartile range of the brightness in a square patch.
fn level_and_spread(frame: &Frame, left: u32, top: u32, side: u32) -> (f64, f64) {
    let mut values: Vec<u8> = (top..top + side)
        .flat_map(|y| (left..left + side).map(move |x| (x, y)))
        .map(|(x, y)| brightness(frame.pixel(x, y)))
        .collect();
    values.sort_unstable();
    let quantile = |quarters: usize| f64::from(values[(values.len() - 1) * quarters / 4]);
    (quantile(2), quantile(3) - quantile(1))
}

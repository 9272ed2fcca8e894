//! The persons that a detector found in a batch of views.

use crate::detection::{BBox, ViewPixels};

/// A person detected in a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewDetection {
    /// Box in corner-origin view pixels, clipped to the view.
    pub bbox: BBox<ViewPixels>,
    /// Confidence, 0 to 1.
    pub score: f64,
}

/// Decoded outputs of a batch of views.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HeadOutput {
    /// The persons of each view, in the order of the network's candidates.
    pub per_view: Vec<Vec<ViewDetection>>,
    /// Candidates dropped because their score was not finite, or because it reached the floor
    /// and their box was not finite or beyond ±1e9 pixels.
    pub non_finite: usize,
}

impl HeadOutput {
    /// Keeps the best `count` detections of each view.
    pub(super) fn keep_best(&mut self, count: usize) {
        for found in &mut self.per_view {
            if found.len() > count {
                found.select_nth_unstable_by(count, |a, b| b.score.total_cmp(&a.score));
                found.truncate(count);
            }
        }
    }
}

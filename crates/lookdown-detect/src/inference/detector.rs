//! The interface of all detectors, and the persons that one found in a batch of views.

use std::num::NonZeroUsize;

use lookdown_imaging::{NetworkInput, ViewBatch};
use lookdown_lens::geometry::Posture;

use super::InferenceError;
use crate::detection::{BBox, ViewPixels};

/// A person detector. Runs on one thread at a time.
pub trait Detector: Send {
    /// The model's name.
    fn name(&self) -> &str;

    /// Identifier that changes with the model.
    fn revision(&self) -> &str;

    /// Input format of the network.
    fn input(&self) -> &NetworkInput;

    /// Number of views per run, if it is fixed. Fewer views cost as much.
    fn views_per_run(&self) -> Option<NonZeroUsize> {
        None
    }

    /// Returns true if the network tells who lies and who is low, in addition to who is a person.
    fn tells_postures(&self) -> bool {
        false
    }

    /// Detects persons in a batch rendered for [`Detector::input`]. Returns one list per view,
    /// unsorted, with overlaps and with scores of at least the detector's floor.
    ///
    /// # Errors
    /// [`InferenceError`] when the runtime fails or its output differs from the declared shape.
    fn detect(&mut self, batch: &ViewBatch) -> Result<HeadOutput, InferenceError>;
}

/// A person detected in a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewDetection {
    /// Box in corner-origin view pixels, clipped to the view.
    pub bbox: BBox<ViewPixels>,
    /// Confidence, 0 to 1.
    pub score: f64,
    /// The posture, where the score is that of a person in a certain posture.
    pub posture: Option<Posture>,
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

//! The interface of all detectors.

use std::num::NonZeroUsize;

use super::{HeadOutput, InferenceError};
use lookdown_imaging::{NetworkInput, ViewBatch};

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

    /// Detects persons in a batch rendered for [`Detector::input`]. Returns one list per view,
    /// unsorted, with overlaps and with scores of at least the detector's floor.
    ///
    /// # Errors
    /// [`InferenceError`] when the runtime fails or its output differs from the declared shape.
    fn detect(&mut self, batch: &ViewBatch) -> Result<HeadOutput, InferenceError>;
}

//! A loaded model, shared by the frames that are looked at with it.

use std::{
    path::PathBuf,
    sync::{Mutex, PoisonError},
};

use super::{Detector, HeadOutput, InferenceError, repository::Stamp};
use crate::imaging::{NetworkInput, ViewBatch};

/// A loaded model. A frame holds on to the one it began with, so that a model that was replaced
/// goes when its last frame has ended.
pub struct Model {
    name: String,
    revision: String,
    input: NetworkInput,
    /// One batch at a time is in the network; the session itself uses several threads.
    detector: Mutex<Box<dyn Detector>>,
    files: Option<ModelFiles>,
}

/// Where a model was loaded from, and what the files were like then.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ModelFiles {
    /// The model's folder or ONNX file.
    pub(super) path: PathBuf,
    pub(super) stamp: Stamp,
}

impl Model {
    /// A model around its detector.
    #[must_use]
    pub fn new(detector: Box<dyn Detector>) -> Self {
        Self {
            name: detector.name().to_owned(),
            revision: detector.revision().to_owned(),
            input: detector.input().clone(),
            detector: Mutex::new(detector),
            files: None,
        }
    }

    pub(super) fn with_files(self, files: ModelFiles) -> Self {
        Self {
            files: Some(files),
            ..self
        }
    }

    pub(super) fn files(&self) -> Option<&ModelFiles> {
        self.files.as_ref()
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Changes whenever the model does.
    #[must_use]
    pub fn revision(&self) -> &str {
        &self.revision
    }

    /// What the network wants to see.
    #[must_use]
    pub fn input(&self) -> &NetworkInput {
        &self.input
    }

    /// Finds persons in a batch rendered for [`Model::input`], after waiting for its turn.
    ///
    /// # Errors
    /// [`InferenceError`] when the network cannot run.
    pub fn detect(&self, batch: &ViewBatch) -> Result<HeadOutput, InferenceError> {
        // A panic inside the run-time leaves no half-changed state of ours behind.
        let mut detector = self.detector.lock().unwrap_or_else(PoisonError::into_inner);
        detector.detect(batch)
    }

    /// Runs the network once on blank views, so that the first frame finds it warm.
    ///
    /// # Errors
    /// [`InferenceError`] when the network cannot run.
    pub fn warm_up(&self, views: usize) -> Result<(), InferenceError> {
        let mut batch = ViewBatch::default();
        for slot in batch.prepare(views, &self.input) {
            slot.fill(0.0);
        }
        self.detect(&batch).map(drop)
    }
}

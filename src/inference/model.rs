//! A loaded model, shared by the frames that are looked at with it.

use std::{
    num::NonZeroUsize,
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
    views_per_run: Option<NonZeroUsize>,
    /// Each runs one batch at a time, side by side with the others.
    sessions: Vec<Mutex<Box<dyn Detector>>>,
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
    /// A model of one session.
    #[must_use]
    pub fn new(session: Box<dyn Detector>) -> Self {
        Self::of_sessions(session, Vec::new())
    }

    /// A model of several sessions of the same network.
    #[must_use]
    pub fn of_sessions(first: Box<dyn Detector>, others: Vec<Box<dyn Detector>>) -> Self {
        Self {
            name: first.name().to_owned(),
            revision: first.revision().to_owned(),
            input: first.input().clone(),
            views_per_run: first.views_per_run(),
            sessions: std::iter::once(first)
                .chain(others)
                .map(Mutex::new)
                .collect(),
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

    /// How many views make a good batch: at most `max_views`, but no less than the network takes at
    /// once, and only whole runs of one that takes a fixed number.
    #[must_use]
    pub fn batch_of(&self, max_views: NonZeroUsize) -> NonZeroUsize {
        let fixed = self.views_per_run.unwrap_or(NonZeroUsize::MIN);
        let runs = (max_views.get() / fixed.get()).max(1);
        fixed.saturating_mul(NonZeroUsize::new(runs).unwrap_or(NonZeroUsize::MIN))
    }

    /// Finds persons in a batch rendered for [`Model::input`], in the session of that number (they
    /// are counted round), after waiting for its turn.
    ///
    /// # Errors
    /// [`InferenceError`] when the network cannot run.
    pub fn detect(&self, session: usize, batch: &ViewBatch) -> Result<HeadOutput, InferenceError> {
        let session = &self.sessions[session % self.sessions.len()];
        // A panic inside the run-time leaves no half-changed state of ours behind.
        let mut session = session.lock().unwrap_or_else(PoisonError::into_inner);
        session.detect(batch)
    }

    /// Runs each session once on blank views, so that the first frame finds them warm.
    ///
    /// # Errors
    /// [`InferenceError`] when the network cannot run.
    pub fn warm_up(&self, max_views: NonZeroUsize) -> Result<(), InferenceError> {
        let mut batch = ViewBatch::default();
        for slot in batch.prepare(self.batch_of(max_views).get(), &self.input) {
            slot.fill(0.0);
        }
        for session in 0..self.sessions.len() {
            self.detect(session, &batch)?;
        }
        Ok(())
    }
}

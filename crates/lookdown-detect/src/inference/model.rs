//! A loaded model, shared by the frames that use it.

use std::{num::NonZeroUsize, path::PathBuf};

use parking_lot::Mutex;

use super::{detector::Detector, error::InferenceError, head_output::HeadOutput, stamp::Stamp};
use lookdown_imaging::{NetworkInput, ViewBatch};

/// A loaded model. A frame keeps a reference to its model, so a replaced model is dropped when its
/// last frame ends.
pub struct Model {
    /// Name of the model.
    pub name: String,
    /// Identifier that changes with the model.
    pub revision: String,
    /// Input format of the network.
    pub input: NetworkInput,
    views_per_run: Option<NonZeroUsize>,
    /// Each session runs one batch at a time, in parallel with the others.
    sessions: Vec<Mutex<Box<dyn Detector>>>,
    pub(super) files: Option<ModelFiles>,
}

/// Origin of a model, and the state of its files at the time of loading.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ModelFiles {
    /// The model's folder or ONNX file.
    pub(super) path: PathBuf,
    pub(super) stamp: Stamp,
}

impl Model {
    /// A model with one session.
    pub fn new(session: Box<dyn Detector>) -> Self {
        Self::from_boxed(session, Vec::new())
    }

    /// Returns a model with several sessions of the same network.
    pub fn from_sessions<D: Detector + 'static>(first: D, others: Vec<D>) -> Self {
        let others = others.into_iter();
        let others = others.map(|session| Box::new(session) as Box<dyn Detector>);
        Self::from_boxed(Box::new(first), others.collect())
    }

    /// [`Model::from_sessions`] with boxed sessions.
    pub(crate) fn from_boxed(first: Box<dyn Detector>, others: Vec<Box<dyn Detector>>) -> Self {
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

    /// The largest useful batch of at most `max_views` views. It is at least the number of views
    /// per run, and a multiple of it where that number is fixed.
    pub fn batch_of(&self, max_views: NonZeroUsize) -> NonZeroUsize {
        let fixed = self.views_per_run.unwrap_or(NonZeroUsize::MIN);
        let runs = (max_views.get() / fixed.get()).max(1);
        fixed.saturating_mul(NonZeroUsize::new(runs).unwrap_or(NonZeroUsize::MIN))
    }

    /// Detects persons in a batch rendered for [`Model::input`], in session `session` modulo the
    /// number of sessions. Blocks until the session is free.
    ///
    /// # Errors
    /// [`InferenceError`] when the network cannot run.
    pub fn detect(&self, session: usize, batch: &ViewBatch) -> Result<HeadOutput, InferenceError> {
        let session = &self.sessions[session % self.sessions.len()];
        // A panic in the runtime leaves no inconsistent state in the session's wrapper.
        let mut session = session.lock();
        session.detect(batch)
    }

    /// Runs each session once on blank views, so that the first frame does not pay for the warm-up.
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

//! The loaded models, shared by the frames that use them, and the detection of changed files
//! without reading them.

use std::{
    collections::BTreeMap,
    num::NonZeroUsize,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
    sync::Arc,
    time::SystemTime,
};

use lookdown_imaging::{NetworkInput, ViewBatch};
use parking_lot::{Mutex, RwLock};

use super::{
    detector::{Detector, HeadOutput},
    error::InferenceError,
    manifest::{FILE_NAME, ModelManifest},
};

/// A loaded model. A frame keeps a reference to its model, so a replaced model is dropped when its
/// last frame ends.
pub struct Model {
    /// Name of the model.
    pub name: String,
    /// Identifier that changes with the model.
    pub revision: String,
    /// Input format of the network.
    pub input: NetworkInput,
    /// True if the network tells who lies and who is low.
    pub tells_postures: bool,
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
            tells_postures: first.tells_postures(),
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

/// Fingerprint of files: inode, length and time of modification, with symbolic links followed.
/// `None` when a file is missing, for example while it is being replaced.
pub(super) type Stamp = Option<Vec<(u64, u64, SystemTime)>>;

/// The files that make a model.
pub(super) fn files_of(model: &Path) -> Vec<PathBuf> {
    let manifest = if model.is_dir() {
        Some(model.join(FILE_NAME))
    } else {
        None
    };
    // If the manifest is invalid, only the manifest itself can be watched.
    let onnx = ModelManifest::locate(model)
        .ok()
        .map(|manifest| manifest.onnx);
    manifest.into_iter().chain(onnx).collect()
}

/// Returns the present fingerprint of the files.
pub(super) fn stamp(files: &[PathBuf]) -> Stamp {
    if files.is_empty() {
        return None;
    }
    let stamps = files.iter().map(|file| {
        let metadata = file.metadata().ok()?;
        Some((metadata.ino(), metadata.len(), metadata.modified().ok()?))
    });
    stamps.collect()
}

/// Largest number of loaded models. Each takes memory for its weights and its work.
const MAX_MODELS: usize = 16;

/// The loaded models, by name. Replacing a model is atomic: a frame gets the old or the new model
/// and keeps it to its end.
#[derive(Default)]
pub struct ModelRegistry(RwLock<BTreeMap<String, Arc<Model>>>);

/// The largest number of models is loaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{MAX_MODELS} models are loaded, which is the limit: unload one first")]
pub struct RegistryFull;

impl ModelRegistry {
    /// Returns the model with that name.
    pub fn get(&self, name: &str) -> Option<Arc<Model>> {
        let models = self.0.read();
        models.get(name).cloned()
    }

    /// Returns every model, sorted by name.
    pub fn all(&self) -> Vec<Arc<Model>> {
        let models = self.0.read();
        models.values().cloned().collect()
    }

    /// Adds a model or replaces the one with the same name, which is returned.
    ///
    /// # Errors
    /// [`RegistryFull`] when the limit is exceeded.
    pub fn put(&self, model: Arc<Model>) -> Result<Option<Arc<Model>>, RegistryFull> {
        let mut models = self.0.write();
        if models.len() >= MAX_MODELS && !models.contains_key(&model.name) {
            return Err(RegistryFull);
        }
        Ok(models.insert(model.name.clone(), model))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::{Detector, HeadOutput, InferenceError};
    use lookdown_imaging::{NetworkInput, ViewBatch};

    struct Blind(String, NetworkInput);

    impl Detector for Blind {
        fn name(&self) -> &str {
            &self.0
        }

        fn revision(&self) -> &'static str {
            "1"
        }

        fn input(&self) -> &NetworkInput {
            &self.1
        }

        fn detect(&mut self, _batch: &ViewBatch) -> Result<HeadOutput, InferenceError> {
            Ok(HeadOutput::default())
        }
    }

    fn blind(name: &str) -> Arc<Model> {
        let detector = Blind(name.to_owned(), NetworkInput::plain(32, 32));
        Arc::new(Model::new(Box::new(detector)))
    }

    #[test]
    fn a_replaced_model_is_dropped_after_its_last_frame() {
        let registry = ModelRegistry::default();
        assert!(registry.put(blind("a")).unwrap().is_none());
        let frame = registry.get("a").unwrap();
        let replaced = Arc::downgrade(&registry.put(blind("a")).unwrap().unwrap());
        assert!(!Arc::ptr_eq(&registry.get("a").unwrap(), &frame));
        assert!(replaced.upgrade().is_some());
        drop(frame);
        assert!(replaced.upgrade().is_none());
    }

    #[test]
    fn the_number_of_models_is_limited_and_replacing_is_allowed() {
        let registry = ModelRegistry::default();
        for index in 0..MAX_MODELS {
            registry.put(blind(&index.to_string())).unwrap();
        }
        assert!(matches!(registry.put(blind("more")), Err(RegistryFull)));
        assert!(registry.put(blind("0")).unwrap().is_some());
        assert_eq!(registry.all().len(), MAX_MODELS);
    }
}

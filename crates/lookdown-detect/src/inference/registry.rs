//! The loaded models, by name.

use std::{collections::BTreeMap, sync::Arc};

use parking_lot::RwLock;

use super::Model;

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

//! The folder of models, and which of them are loaded: loaded and unloaded on request, reloaded
//! when their files change.
//!
//! A model takes its place only after it was loaded, checked and run once. One that fails leaves
//! the model it was to replace where it is.

mod error;
mod folder;
mod stamp;

use std::{
    collections::BTreeMap,
    num::NonZeroUsize,
    path::Path,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError, TryLockError,
        atomic::{AtomicU64, Ordering},
    },
};

use self::stamp::{files_of, stamp};
use super::{InferenceError, Model, ModelRegistry, RemoteServer, model::ModelFiles};

pub use error::RepositoryError;
pub use folder::{ModelFolder, is_fetched};
pub(super) use stamp::Stamp;

/// Makes a model of its folder or ONNX file.
pub type ModelLoader = Box<dyn Fn(&Path) -> Result<Model, InferenceError> + Send + Sync>;

/// Which models there are, and how they are treated.
#[derive(Debug, Clone)]
pub struct RepositoryOptions {
    /// Where they are.
    pub folder: ModelFolder,
    /// How many views a model has to see before it takes its place.
    pub warm_up_views: NonZeroUsize,
    /// Models that requests rely on without naming them: they are never unloaded.
    pub kept: Vec<String>,
}

/// The folder of models, and which of them are loaded.
pub struct ModelRepository {
    options: RepositoryOptions,
    registry: Arc<ModelRegistry>,
    loader: ModelLoader,
    remote: Option<Arc<RemoteServer>>,
    /// Held while a model is loaded: one at a time.
    memory: Mutex<Memory>,
    succeeded: AtomicU64,
    failed: AtomicU64,
}

/// What is known of models beside those that are loaded.
#[derive(Default)]
struct Memory {
    /// Why a model's last load failed.
    failures: BTreeMap<String, String>,
    /// What changed files were like when they were last looked at.
    changed: BTreeMap<String, Stamp>,
    /// What files were like that are not to be tried again.
    refused: BTreeMap<String, Stamp>,
}

/// A model of the repository.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RepositoryRow {
    /// Its name.
    pub name: String,
    /// The revision that answers, if one does.
    pub revision: Option<String>,
    /// Why it is not loaded, or why its last load failed.
    pub reason: Option<String>,
}

/// How many loads succeeded and failed since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LoadCounts {
    /// Loads whose model answers, or has answered.
    pub succeeded: u64,
    /// Loads whose model was refused.
    pub failed: u64,
}

impl ModelRepository {
    /// The models that `options` describe, none of them loaded.
    #[must_use]
    pub fn new(options: RepositoryOptions, loader: ModelLoader) -> Self {
        Self {
            options,
            registry: Arc::default(),
            loader,
            remote: None,
            memory: Mutex::default(),
            succeeded: AtomicU64::new(0),
            failed: AtomicU64::new(0),
        }
    }

    /// The same, with the server that the networks of its models run on.
    #[must_use]
    pub fn on(self, remote: Arc<RemoteServer>) -> Self {
        Self {
            remote: Some(remote),
            ..self
        }
    }

    /// The server that the networks run on, if they do not run here.
    #[must_use]
    pub fn remote(&self) -> Option<&Arc<RemoteServer>> {
        self.remote.as_ref()
    }

    /// Whether networks can run as far as another server decides.
    #[must_use]
    pub fn is_remote_available(&self) -> bool {
        self.remote
            .as_ref()
            .is_none_or(|remote| remote.is_available())
    }

    /// The models that answer.
    #[must_use]
    pub fn registry(&self) -> &Arc<ModelRegistry> {
        &self.registry
    }

    /// How many loads succeeded and failed.
    #[must_use]
    pub fn load_counts(&self) -> LoadCounts {
        LoadCounts {
            succeeded: self.succeeded.load(Ordering::Relaxed),
            failed: self.failed.load(Ordering::Relaxed),
        }
    }

    /// Loads the model of that name, or loads it again. Blocks.
    ///
    /// # Errors
    /// [`RepositoryError`] when there is no such model, it fails its check, there is no room, or
    /// another model is being loaded.
    pub fn load(&self, name: &str) -> Result<Arc<Model>, RepositoryError> {
        let mut memory = self.try_lock()?;
        let path = self.options.folder.find(name)?;
        self.replace(&mut memory, name, &path)
    }

    /// Takes a model out. Frames that began with it finish with it.
    ///
    /// # Errors
    /// [`RepositoryError`] when it is not loaded, must be kept, or a model is being loaded, which may be
    /// this one.
    pub fn unload(&self, name: &str) -> Result<(), RepositoryError> {
        if self.options.kept.iter().any(|kept| kept == name) {
            return Err(RepositoryError::Kept {
                name: name.to_owned(),
            });
        }
        let _no_load = self.try_lock()?;
        let removed = self.registry.remove(name);
        let removed = removed.ok_or_else(|| RepositoryError::NotLoaded {
            name: name.to_owned(),
        })?;
        tracing::info!(model = name, revision = removed.revision(), "unloaded");
        Ok(())
    }

    /// Every model that is loaded or in the folder, by name.
    #[must_use]
    pub fn rows(&self) -> Vec<RepositoryRow> {
        let mut rows: BTreeMap<String, RepositoryRow> = BTreeMap::new();
        let failures = self.lock().failures.clone();
        let row = |name: &str, revision, reason: Option<String>| RepositoryRow {
            name: name.to_owned(),
            revision,
            reason: failures.get(name).cloned().or(reason),
        };
        for name in self.options.folder.names() {
            let reason = self.options.folder.why_not_loaded(&name);
            rows.insert(name.clone(), row(&name, None, Some(reason)));
        }
        for model in self.registry.all() {
            let revision = Some(model.revision().to_owned());
            rows.insert(model.name().to_owned(), row(model.name(), revision, None));
        }
        rows.into_values().collect()
    }

    /// Reloads the models whose files have changed. Files must be the same at two looks, so that
    /// none is read while it is written, and a model that failed is not tried again until they
    /// change again.
    pub fn reload_changed(&self) {
        if !self.is_remote_available() {
            return;
        }
        let mut memory = self.lock();
        for model in self.registry.all() {
            let Some(files) = model.files() else { continue };
            let name = model.name();
            let found = stamp(&files_of(&files.path));
            let is_news =
                found.is_some() && found != files.stamp && memory.refused.get(name) != Some(&found);
            if !is_news {
                memory.changed.remove(name);
            } else if memory.changed.get(name) == Some(&found) {
                memory.changed.remove(name);
                // It was logged, and the rows tell it.
                let _ = self.replace(&mut memory, name, &files.path);
            } else {
                memory.changed.insert(name.to_owned(), found);
            }
        }
    }

    /// Load, check, warm up, replace.
    fn replace(
        &self,
        memory: &mut Memory,
        name: &str,
        path: &Path,
    ) -> Result<Arc<Model>, RepositoryError> {
        // Before reading: a file that changes meanwhile is read again.
        let stamp = stamp(&files_of(path));
        let outcome = self.checked(name, path, &stamp).and_then(|model| {
            let model = Arc::new(model);
            let replaced = self.registry.put(Arc::clone(&model))?;
            Ok((model, replaced))
        });
        match outcome {
            Ok((model, replaced)) => {
                self.succeeded.fetch_add(1, Ordering::Relaxed);
                memory.failures.remove(name);
                memory.refused.remove(name);
                let replaced = replaced.as_ref().map(|replaced| replaced.revision());
                tracing::info!(
                    model = name,
                    revision = model.revision(),
                    replaced,
                    "loaded"
                );
                Ok(model)
            }
            Err(error) => {
                self.failed.fetch_add(1, Ordering::Relaxed);
                memory.failures.insert(name.to_owned(), error.to_string());
                if error.is_of_model() {
                    memory.refused.insert(name.to_owned(), stamp);
                }
                tracing::error!(model = name, "not loaded: {error}");
                Err(error)
            }
        }
    }

    fn checked(&self, name: &str, path: &Path, stamp: &Stamp) -> Result<Model, RepositoryError> {
        let model = (self.loader)(path)?;
        if model.name() != name {
            return Err(RepositoryError::OtherName {
                name: name.to_owned(),
                found: model.name().to_owned(),
                path: path.to_owned(),
            });
        }
        let model = model.with_files(ModelFiles {
            path: path.to_owned(),
            stamp: stamp.clone(),
        });
        model.warm_up(self.options.warm_up_views)?;
        Ok(model)
    }

    /// Unless a model is being loaded.
    fn try_lock(&self) -> Result<MutexGuard<'_, Memory>, RepositoryError> {
        self.memory.try_lock().or_else(|error| match error {
            TryLockError::Poisoned(poisoned) => Ok(poisoned.into_inner()),
            TryLockError::WouldBlock => Err(RepositoryError::Busy),
        })
    }

    fn lock(&self) -> MutexGuard<'_, Memory> {
        // What a panic leaves behind are complete entries.
        self.memory.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

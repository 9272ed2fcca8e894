//! The calibrations of a store in memory: looked up without blocking, and replaced when their files
//! change. A broken new version leaves the old one serving and is told until it is mended.

mod change;
mod content;
mod error;
mod load;
mod named_file;
mod snapshot;

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError, RwLock,
        atomic::{AtomicU64, Ordering},
    },
};

use self::{
    load::LoadedFile,
    named_file::{NamedFile, by_id},
    snapshot::Snapshot,
};
use super::{
    Calibration, CalibrationError, CalibrationFile, CalibrationId, CalibrationStore, StoreError,
};

pub use change::{Put, WriteCondition};
pub use content::CalibrationEntry;
pub use error::ChangeError;
pub use snapshot::{CalibrationRow, CalibrationsHealth};

/// The calibrations of a store. Shared; lookups never wait for the store.
#[derive(Debug)]
pub struct Calibrations {
    store: Box<dyn CalibrationStore>,
    writable: bool,
    now: RwLock<Arc<Snapshot>>,
    /// Held while the store is read or changed: one at a time.
    changing: Mutex<()>,
    succeeded: AtomicU64,
    failed: AtomicU64,
}

impl Calibrations {
    /// Reads every calibration of `store`; `writable` says whether [`Calibrations::put`] and
    /// [`Calibrations::delete`] may change it. Blocks.
    ///
    /// # Errors
    /// When the store cannot be listed. A file that cannot be used costs only its calibrations.
    pub fn open(store: Box<dyn CalibrationStore>, writable: bool) -> Result<Self, StoreError> {
        let calibrations = Self {
            store,
            writable,
            now: RwLock::default(),
            changing: Mutex::default(),
            succeeded: AtomicU64::new(0),
            failed: AtomicU64::new(0),
        };
        calibrations.look(&calibrations.lock())?;
        Ok(calibrations)
    }

    /// The calibration `id`; `None` when there is none. Does not block.
    ///
    /// # Errors
    /// [`CalibrationError`] when its file has never held one that can be used, or several.
    pub fn get(&self, id: &CalibrationId) -> Result<Option<Arc<Calibration>>, CalibrationError> {
        let now = self.now();
        if let Some(entry) = now.entry(id) {
            return Ok(Some(Arc::clone(&entry.calibration)));
        }
        match now.why_unusable(id) {
            Some((file, problem)) => Err(CalibrationError::Stored {
                place: format!("{}/{file}", self.store.place()),
                problem,
            }),
            None => Ok(None),
        }
    }

    /// What is known of the calibration `id` that serves. Does not block.
    #[must_use]
    pub fn entry(&self, id: &CalibrationId) -> Option<Arc<CalibrationEntry>> {
        self.now().entry(id).cloned()
    }

    /// Every calibration that serves or should, by ID. Does not block.
    #[must_use]
    pub fn rows(&self) -> Vec<CalibrationRow> {
        self.now().rows()
    }

    /// How the calibrations are. Does not block.
    #[must_use]
    pub fn health(&self) -> CalibrationsHealth {
        CalibrationsHealth {
            loads_succeeded: self.succeeded.load(Ordering::Relaxed),
            loads_failed: self.failed.load(Ordering::Relaxed),
            ..self.now().health()
        }
    }

    /// Looks at the store and reads the files that have changed. What fails is logged, told by
    /// [`Calibrations::health`], and leaves the calibrations it concerns as they are. Blocks.
    pub fn refresh(&self) {
        let changing = self.lock();
        if let Err(error) = self.look(&changing) {
            let problem = error.to_string();
            let now = self.now();
            if now.store_problem.as_ref() != Some(&problem) {
                tracing::error!(
                    "calibrations cannot be looked at, the known ones go on: {problem}"
                );
                self.replace(now.with_store_problem(problem));
            }
        }
    }

    /// Lists the store and reads what has changed.
    fn look(&self, _changing: &MutexGuard<'_, ()>) -> Result<(), StoreError> {
        let before = self.now();
        let listed = by_id(self.store.list()?);
        let is_news = before.store_problem.is_some()
            || listed.len() != before.files.len()
            || listed.iter().any(|(id, named)| {
                let known = before.files.get(id);
                known.is_none_or(|known| known.named != *named)
            });
        if !is_news {
            return Ok(());
        }
        let mut files = BTreeMap::new();
        for (id, named) in listed {
            let known = before.files.get(&id);
            let file = match known {
                Some(known) if known.named == named => Arc::clone(known),
                _ => Arc::new(self.load(&id, named, known)),
            };
            files.insert(id, file);
        }
        for gone in before.files.keys().filter(|id| !files.contains_key(id)) {
            tracing::info!(calibration = %gone, "its file is gone");
        }
        self.replace(Snapshot::of(files));
        Ok(())
    }

    fn load(
        &self,
        id: &CalibrationId,
        named: NamedFile,
        known: Option<&Arc<LoadedFile>>,
    ) -> LoadedFile {
        // One byte more than is accepted, so that a larger file is known for one.
        let content = self
            .store
            .read(&named.file.name, CalibrationFile::MAX_BYTES + 1);
        let known = known.map(Arc::as_ref);
        let loaded = LoadedFile::new(id, named, content, known);
        if loaded.is_news(known) {
            let counter = if loaded.problems.is_empty() {
                &self.succeeded
            } else {
                &self.failed
            };
            counter.fetch_add(1, Ordering::Relaxed);
            loaded.log(known);
        }
        loaded
    }

    fn now(&self) -> Arc<Snapshot> {
        Arc::clone(&self.now.read().unwrap_or_else(PoisonError::into_inner))
    }

    fn replace(&self, snapshot: Snapshot) {
        *self.now.write().unwrap_or_else(PoisonError::into_inner) = Arc::new(snapshot);
    }

    fn lock(&self) -> MutexGuard<'_, ()> {
        // Guards no data that a panic could leave half changed.
        self.changing.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests;

//! The calibrations of a store in memory: looked up without blocking, and replaced when their files
//! change. A broken new version leaves the old one serving and is reported until it is fixed.

mod content;
mod snapshot;
#[cfg(test)]
mod tests;

use std::{
    collections::BTreeMap,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::sync_channel,
    },
    thread,
    time::Duration,
};

use lookdown_calibration::{Calibration, CalibrationFile, CalibrationId};
use lookdown_detect::{
    metrics::start_at_zero,
    pipeline::{CalibrationLookup, UnusableCalibration},
};
use parking_lot::{Mutex, MutexGuard, RwLock};

pub use content::{CalibrationEntry, ChangeError, Reading, defaults};
pub use snapshot::{CalibrationRow, CalibrationsHealth};

use self::{
    content::import,
    snapshot::{LoadedFile, Snapshot, by_id, sample, written_name},
};
use super::{CalibrationStore, ListedFile, Replaces, StoreError};
use crate::metrics::Metrics;

/// The calibrations of a store. Shared; lookups never wait for the store.
#[derive(Debug)]
pub struct Calibrations {
    store: Box<dyn CalibrationStore>,
    writable: bool,
    /// True when the store was read once, with or without success.
    is_read: AtomicBool,
    now: RwLock<Arc<Snapshot>>,
    /// Held while the store is read or changed: one at a time.
    // Guards no data that a panic could leave half changed.
    changing: Mutex<()>,
    metrics: Arc<Metrics>,
}

impl Calibrations {
    /// Reads every calibration of `store`; `writable` says whether [`Calibrations::put`] and
    /// [`Calibrations::delete`] may change it. Blocks.
    ///
    /// # Errors
    /// Returns an error if the store cannot be listed. A file that cannot be used costs only its
    /// calibrations.
    pub fn open(
        store: Box<dyn CalibrationStore>,
        writable: bool,
        metrics: Arc<Metrics>,
    ) -> Result<Self, StoreError> {
        let calibrations = Self::unread(store, writable, metrics);
        calibrations.scan(&calibrations.changing.lock())?;
        calibrations.is_read.store(true, Ordering::Relaxed);
        Ok(calibrations)
    }

    /// Like [`Calibrations::open`], but waits for at most `timeout`. After that, the rest is read
    /// in the background ([`Calibrations::is_read`]), and a failure is reported by
    /// [`Calibrations::health`].
    ///
    /// # Errors
    /// Those of [`Calibrations::open`] within `timeout`.
    pub fn open_within(
        store: Box<dyn CalibrationStore>,
        writable: bool,
        timeout: Duration,
        metrics: Arc<Metrics>,
    ) -> Result<Arc<Self>, StoreError> {
        let calibrations = Arc::new(Self::unread(store, writable, metrics));
        let (done, outcome) = sync_channel(0);
        let reading = Arc::clone(&calibrations);
        let read = move || {
            let changing = reading.changing.lock();
            let outcome = reading.scan(&changing);
            if let Err(Err(error)) = done.send(outcome).map_err(|unsent| unsent.0) {
                reading.keep_all(&error);
            }
            reading.is_read.store(true, Ordering::Relaxed);
        };
        let thread = thread::Builder::new().name("calibration-reader".to_owned());
        thread.spawn(read).map_err(|error| StoreError::Failed {
            place: calibrations.store.place(),
            problem: format!("the operating system gives no thread: {error}"),
        })?;
        if let Ok(outcome) = outcome.recv_timeout(timeout) {
            outcome?;
        } else {
            let place = calibrations.store.place();
            tracing::warn!(
                "reading the calibrations of {place} takes long: the rest is read in the background"
            );
        }
        Ok(calibrations)
    }

    fn unread(store: Box<dyn CalibrationStore>, writable: bool, metrics: Arc<Metrics>) -> Self {
        start_at_zero(&metrics.calibration_loads, &["success", "failure"]);
        Snapshot::default().publish(&metrics, None);
        Self {
            store,
            writable,
            is_read: AtomicBool::new(false),
            now: RwLock::default(),
            changing: Mutex::default(),
            metrics,
        }
    }

    /// Returns true when the store was read once. Before that, calibrations are unknown that the
    /// store has.
    pub fn is_read(&self) -> bool {
        self.is_read.load(Ordering::Relaxed)
    }

    /// Returns the entry of the calibration `id` that serves: of the store, else of a sample frame.
    /// Does not block.
    pub fn entry(&self, id: &CalibrationId) -> Option<Arc<CalibrationEntry>> {
        let now = self.now();
        now.entry_or_sample(id).cloned()
    }

    /// Every calibration of the store that serves or should, by ID. Does not block.
    pub fn rows(&self) -> Vec<CalibrationRow> {
        self.now().rows()
    }

    /// Returns the health of the calibrations. Does not block.
    pub fn health(&self) -> CalibrationsHealth {
        self.now().health()
    }

    fn now(&self) -> Arc<Snapshot> {
        Arc::clone(&self.now.read())
    }

    fn replace(&self, snapshot: Snapshot) {
        snapshot.publish(&self.metrics, Some(&self.now()));
        *self.now.write() = Arc::new(snapshot);
    }

    /// Reads `content` as the calibration `id`, by the rules of [`Calibrations::put`]; nothing is
    /// stored.
    ///
    /// # Errors
    /// [`ChangeError`] for content that cannot be a calibration.
    pub fn check(
        id: &CalibrationId,
        content: &[u8],
        reading: &Reading,
    ) -> Result<CalibrationEntry, ChangeError> {
        import(id, &written_name(id), content, reading).map(|(entry, _)| entry)
    }

    /// Checks `content`, a calibration file in any format with one camera or with that called
    /// `camera`, and stores it as the calibration `id`, in the native format. It serves when this
    /// returns. Blocks.
    ///
    /// # Errors
    /// [`ChangeError`]; then nothing has changed, but for [`ChangeError::Unseen`].
    pub fn put(
        &self,
        id: &CalibrationId,
        content: &[u8],
        reading: &Reading,
        condition: &WriteCondition,
    ) -> Result<Put, ChangeError> {
        if !self.writable {
            return Err(ChangeError::NotWritable);
        }
        let name = written_name(id);
        let (entry, written) = import(id, &name, content, reading)?;
        let changing = self.changing.lock();
        // What others have stored since the last look counts, too.
        self.scan(&changing)?;
        let before = self.now();
        let replaced = before.entry_or_sample(id);
        condition.check(replaced.map(Arc::as_ref))?;
        let file = before.files.get(id);
        if let Some(shared) = file.filter(|file| file.holds_several) {
            return Err(shared_file(shared));
        }
        let expected = condition.replaces(file.map(|file| &file.named.file), &name);
        self.store.write(&name, written.as_bytes(), expected)?;
        // It hides the others, so that neither a kill nor a failure from here on does harm.
        let others = file.into_iter().flat_map(|file| file.names());
        others
            .filter(|other| *other != name)
            .try_for_each(|hidden| self.store.delete(hidden))
            .and_then(|()| self.scan(&changing))
            .map_err(ChangeError::Unseen)?;
        Ok(Put {
            entry: Arc::new(entry),
            created: replaced.is_none(),
        })
    }

    /// Deletes the calibration `id` with its file. Blocks.
    ///
    /// # Errors
    /// [`ChangeError`].
    pub fn delete(
        &self,
        id: &CalibrationId,
        condition: &WriteCondition,
    ) -> Result<(), ChangeError> {
        if !self.writable {
            return Err(ChangeError::NotWritable);
        }
        let changing = self.changing.lock();
        self.scan(&changing)?;
        let before = self.now();
        let entry = before.entry(id);
        let file = before.files.get(id);
        if entry.is_none() && file.is_none() {
            let id = id.clone();
            return Err(match sample(&id) {
                Some(_) => ChangeError::Sample { id },
                None => ChangeError::Unknown { id },
            });
        }
        condition.check(entry.map(Arc::as_ref))?;
        let holder = || {
            before
                .files
                .values()
                .find(|file| file.cameras.contains_key(id))
        };
        let Some(file) = file.or_else(holder).filter(|file| !file.holds_several) else {
            let shared = file.or_else(holder).map(|file| shared_file(file));
            return Err(shared.unwrap_or(ChangeError::Unknown { id: id.clone() }));
        };
        // The one that counts last: until then it hides the others.
        for name in file.names().rev() {
            self.store.delete(name)?;
        }
        self.scan(&changing).map_err(ChangeError::Unseen)
    }
}

impl CalibrationLookup for Calibrations {
    fn get(&self, id: &CalibrationId) -> Result<Option<Arc<Calibration>>, UnusableCalibration> {
        let now = self.now();
        if let Some(entry) = now.entry_or_sample(id) {
            return Ok(Some(Arc::clone(&entry.calibration)));
        }
        match now.why_unusable(id) {
            Some((file, problem)) => Err(UnusableCalibration {
                place: format!("{}/{file}", self.store.place()),
                problem,
            }),
            None => Ok(None),
        }
    }
}

/// The precondition of a change to a calibration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum WriteCondition {
    /// No precondition.
    Always,
    /// The calibration must not exist.
    IfAbsent,
    /// The calibration must exist.
    IfPresent,
    /// The calibration must exist at one of these revisions.
    IfRevision(Vec<String>),
}

/// A calibration that was written.
#[derive(Debug, Clone)]
pub struct Put {
    /// The calibration that serves now.
    pub entry: Arc<CalibrationEntry>,
    /// True when there was none before.
    pub created: bool,
}

impl LoadedFile {
    /// The names of the files of its ID, the one that counts first.
    fn names(&self) -> impl DoubleEndedIterator<Item = &str> {
        let hidden = self.named.hidden.iter().map(String::as_str);
        std::iter::once(self.named.file.name.as_str()).chain(hidden)
    }
}

fn shared_file(file: &LoadedFile) -> ChangeError {
    ChangeError::Shared {
        file: file.named.file.name.clone(),
        ids: file.cameras.keys().map(ToString::to_string).collect(),
    }
}

impl WriteCondition {
    /// Returns the content that the file called `name` may replace under this condition, when
    /// `known` is that of its ID: no change that was made after the condition was checked.
    fn replaces<'a>(&self, known: Option<&'a ListedFile>, name: &str) -> Replaces<'a> {
        match known {
            _ if *self == Self::Always => Replaces::Anything,
            Some(file) if file.name == name => Replaces::Stamp(&file.stamp),
            _ => Replaces::Nothing,
        }
    }

    fn check(&self, now: Option<&CalibrationEntry>) -> Result<(), ChangeError> {
        let revision = now.map(|entry| entry.calibration.revision());
        let is_met = match self {
            Self::Always => true,
            Self::IfAbsent => revision.is_none(),
            Self::IfPresent => revision.is_some(),
            Self::IfRevision(wanted) => {
                revision.is_some_and(|revision| wanted.iter().any(|wanted| wanted == revision))
            }
        };
        if is_met {
            return Ok(());
        }
        let now = revision.map_or("not there".to_owned(), |revision| {
            format!("at revision {revision}")
        });
        Err(ChangeError::Outdated { now })
    }
}

impl Calibrations {
    /// Lists the store and reads the files that have changed. Failures are logged, reported by
    /// [`Calibrations::health`], and leave the affected calibrations unchanged. Blocks.
    pub fn refresh(&self) {
        let changing = self.changing.lock();
        if let Err(error) = self.scan(&changing) {
            self.keep_all(&error);
        }
    }

    /// Logs and reports that the store cannot be read.
    fn keep_all(&self, error: &StoreError) {
        let problem = error.to_string();
        let now = self.now();
        if now.store_problem.as_ref() != Some(&problem) {
            tracing::error!("calibrations cannot be read, the loaded ones stay in use: {problem}");
            self.replace(now.with_store_problem(problem));
        }
    }

    /// Lists the store and reads what has changed.
    fn scan(&self, _changing: &MutexGuard<'_, ()>) -> Result<(), StoreError> {
        let before = self.now();
        let listed = by_id(self.store.list()?);
        let gone = before.files.keys().filter(|id| !listed.contains_key(id));
        let gone: Vec<_> = gone.cloned().collect();
        let (mut files, mut changed) = (BTreeMap::new(), Vec::new());
        for (id, named) in listed {
            match before.files.get(&id) {
                Some(known) if known.named == named => {
                    files.insert(id, Arc::clone(known));
                }
                _ => changed.push((id, named)),
            }
        }
        if before.store_problem.is_none() && gone.is_empty() && changed.is_empty() {
            return Ok(());
        }
        for (id, named) in changed {
            let known = before.files.get(&id).map(Arc::as_ref);
            // One byte more than is accepted, so that a larger file is known for one.
            let content = self
                .store
                .read(&named.file.name, CalibrationFile::MAX_BYTES + 1);
            let loaded = LoadedFile::new(&id, named, content, known);
            self.record_change(&loaded, known);
            files.insert(id, Arc::new(loaded));
        }
        for gone in gone {
            tracing::info!(calibration = %gone, "its file is gone");
        }
        if before.store_problem.is_some() {
            tracing::info!("calibrations can be read again");
        }
        self.replace(Snapshot::new(files));
        Ok(())
    }

    /// Counts and logs what a file changes.
    fn record_change(&self, loaded: &LoadedFile, known: Option<&LoadedFile>) {
        if !loaded.is_changed(known) {
            return;
        }
        let result = if loaded.problems.is_empty() {
            "success"
        } else {
            "failure"
        };
        let loads = &self.metrics.calibration_loads;
        loads.with_label_values(&[result]).inc();
        loaded.log(known);
    }
}

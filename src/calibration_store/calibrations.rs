//! The calibrations of a store in memory: looked up without blocking, and replaced when their files
//! change. A broken new version leaves the old one serving and is reported until it is fixed.

mod change;
mod content;
mod load;
mod samples;
mod scan;
mod snapshot;

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::sync_channel,
    },
    thread,
    time::Duration,
};

use lookdown_calibration::{Calibration, CalibrationId};
use lookdown_detect::{
    metrics::start_at_zero,
    pipeline::{CalibrationLookup, UnusableCalibration},
};
use parking_lot::{Mutex, MutexGuard, RwLock};

use self::snapshot::Snapshot;
use super::{CalibrationStore, StoreError};
use crate::metrics::Metrics;

pub use change::{Put, WriteCondition};
pub use content::ChangeError;
pub use content::{CalibrationEntry, Reading, defaults};
pub use snapshot::{CalibrationRow, CalibrationsHealth};

/// The calibrations of a store. Shared; lookups never wait for the store.
#[derive(Debug)]
pub struct Calibrations {
    store: Box<dyn CalibrationStore>,
    writable: bool,
    /// True when the store was read once, with or without success.
    is_read: AtomicBool,
    now: RwLock<Arc<Snapshot>>,
    /// Held while the store is read or changed: one at a time.
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
        calibrations.scan(&calibrations.lock())?;
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
            let changing = reading.lock();
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

    fn lock(&self) -> MutexGuard<'_, ()> {
        // Guards no data that a panic could leave half changed.
        self.changing.lock()
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

#[cfg(test)]
mod tests;

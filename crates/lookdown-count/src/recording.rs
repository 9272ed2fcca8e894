//! Counting of recordings: reports in order, with the times of the recording and without a server.

use std::{
    collections::BTreeSet,
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};

use jiff::Timestamp;
use lookdown_calibration::Calibration;
use lookdown_tracking::MAX_CAMERAS;

use crate::{
    calibrations::Calibrations,
    counter::{Counter, CountingOptions},
    definition::CameraDefinition,
    http::{MAX_VALUES, table},
    now::Now,
    report::ReceivedReport,
    scene::{Scene, seconds},
    snapshot::LineSnapshot,
    store::{Span, Store, StoreError},
    sums::{MINUTE_MS, Owner},
};

/// Interval of the transactions.
const COMMIT_EVERY: Duration = Duration::from_secs(2);

/// The counts of the recordings of a camera, in a store as that of `lookdown count`.
pub struct Recording {
    camera: String,
    calibration: Option<Arc<Calibration>>,
    counter: Counter,
    store: Store,
    next_commit: Instant,
    began: Instant,
    /// The time of the first frame that this process counts.
    first: Option<Timestamp>,
}

/// A report that is not counted.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The store cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Not a report of a server.
    #[error("the report cannot be read: {0}")]
    Report(#[from] serde_json::Error),
}

impl Recording {
    /// Opens or creates a store. Blocks.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn open(
        store: &Path,
        longest_gap: Duration,
        camera: &str,
        calibration: Option<Arc<Calibration>>,
    ) -> Result<Self, StoreError> {
        let store = Store::open(store)?;
        let resumed = store.resumed()?;
        let counting = CountingOptions {
            longest_gap_ms: i64::try_from(longest_gap.as_millis()).unwrap_or(i64::MAX),
            max_cameras: MAX_CAMERAS,
            ..CountingOptions::default()
        };
        // Other cameras of the store have other recordings. A store of an earlier version has no
        // state of its cameras.
        let mut states = resumed.scenes.iter();
        let last_event = match states.find_map(|state| state.last_event_of(camera)) {
            Some(own) => own,
            None if resumed.scenes.is_empty() => resumed.last_event,
            None => 0,
        };
        let mut counter = Counter::new(counting, last_event, resumed.totals);
        let others = Calibrations::resumed(resumed.calibrations);
        for state in resumed.scenes {
            counter.resume(state, |key| match &calibration {
                Some(own) if key.calibration.as_deref() == Some(own.id().as_str()) => {
                    Arc::new(CameraDefinition::new(key, own))
                }
                _ => others.definition(key),
            });
        }
        Ok(Self {
            camera: camera.to_owned(),
            calibration,
            counter,
            store,
            next_commit: Instant::now() + COMMIT_EVERY,
            began: Instant::now(),
            first: None,
        })
    }

    /// Returns the time of the last report of the camera that is counted.
    pub fn counted_until(&self) -> Option<Timestamp> {
        let micros = i64::try_from(self.counter.last_event).ok();
        let micros = micros.filter(|micros| *micros > 0)?;
        Timestamp::from_microsecond(micros).ok()
    }

    /// Counts a report of a frame that was captured at this time. A report up to
    /// [`Self::counted_until`] was counted before. Blocks.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn count(&mut self, at: Timestamp, report: &[u8]) -> Result<(), RecordingError> {
        let mut report = serde_json::from_slice::<ReceivedReport>(report)?.captured(at);
        report.camera.clone_from(&self.camera);
        let key = report.definition_key();
        let known = self.counter.definition(&self.camera);
        let known = known.filter(|definition| definition.key == key);
        let definition = known.unwrap_or_else(|| {
            Arc::new(match &self.calibration {
                Some(calibration) if key.calibration.is_some() => {
                    CameraDefinition::new(key, calibration)
                }
                _ => CameraDefinition::without_calibration(key),
            })
        });
        let event = u64::try_from(at.as_microsecond()).unwrap_or_default();
        let now = self.clocks(at);
        self.counter.accept(event, &report, &definition, now);
        if Instant::now() >= self.next_commit {
            self.commit()?;
        }
        Ok(())
    }

    /// Returns clocks that run with the recording.
    fn clocks(&mut self, at: Timestamp) -> Now {
        let first = *self.first.get_or_insert(at);
        let position = Duration::try_from(at.duration_since(first));
        Now {
            unix_ms: at.as_millisecond(),
            instant: self.began + position.unwrap_or_default(),
        }
    }

    /// Stores all counts. Blocks.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn commit(&mut self) -> Result<(), StoreError> {
        self.next_commit = Instant::now() + COMMIT_EVERY;
        if let Some(batch) = self.counter.take_batch() {
            self.store.commit(&batch, &[], None)?;
            self.counter.stored(&batch);
        }
        Ok(())
    }

    /// Returns true if this process has counted a report.
    pub fn has_counted(&self) -> bool {
        self.first.is_some()
    }

    /// Returns the persons at the last report.
    pub fn persons(&self) -> u64 {
        let scene = self.counter.scene_of(&self.camera);
        scene.map_or(0, |scene| scene.presence().persons)
    }

    /// Returns the indices of the persons in the report of this time, the last one, that are
    /// followed and count.
    pub fn followed(&self, at: Timestamp) -> BTreeSet<usize> {
        let at_s = seconds(at.as_millisecond());
        let tracks = self.counter.scene_of(&self.camera).into_iter();
        let tracks = tracks.flat_map(Scene::tracks);
        let seen = tracks.filter(|track| track.seen_s.total_cmp(&at_s).is_eq());
        seen.map(|track| track.last_person.person).collect()
    }

    /// Returns the crossings of the lines of the camera since the store was created.
    pub fn lines(&self) -> Vec<LineSnapshot> {
        let snapshot = self.counter.snapshot(0);
        let cameras = snapshot.cameras.into_iter();
        let mut own = cameras.filter(|camera| camera.name == self.camera);
        own.next().map(|camera| camera.lines).unwrap_or_default()
    }

    /// Returns the stored counts of a time as CSV, one row per step of whole minutes, or `None` if
    /// there are too many. Blocks.
    ///
    /// # Errors
    /// [`StoreError`].
    pub fn csv(
        &self,
        (from, to): (Timestamp, Timestamp),
        step_minutes: u32,
    ) -> Result<Option<String>, StoreError> {
        let span = Span {
            from_minute: from.as_millisecond().div_euclid(MINUTE_MS),
            to_minute: (to.as_millisecond() + MINUTE_MS - 1).div_euclid(MINUTE_MS),
            step_minutes: i64::from(step_minutes.max(1)),
        };
        let owner = Owner::Camera(self.camera.clone());
        let Some(sums) = self.store.steps(&owner, span, MAX_VALUES)? else {
            return Ok(None);
        };
        let definition = self.counter.definition(&self.camera);
        Ok(table(owner, span, &sums, definition.as_deref()))
    }
}

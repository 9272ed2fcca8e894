//! Reports in the memory of this process.
//!
//! Reports in memory, and their eviction when a limit is exceeded.
//!
//! The latest image of each camera that has one.

use std::{
    collections::{BTreeMap, HashMap, VecDeque},
    num::NonZeroUsize,
    ops::Bound::{Excluded, Unbounded},
    sync::Arc,
};

use async_trait::async_trait;
use jiff::{SignedDuration, Timestamp};
use lookdown_common::OwnCameras;
use lookdown_detect::fairness::Client;
use parking_lot::{Mutex, MutexGuard};

use super::{
    Cameras, ListenError, Listeners, Listening, NewReport, ReportId, ResultLimits, ResultStore,
    ResultUse, StoreHealth, StoredImage, StoredReport, Unreachable,
};
use crate::{annotated_image::StoredFrame, metrics::Metrics};

/// Keeps reports in memory, within limits. They are lost when the process ends.
#[derive(Debug)]
pub struct MemoryResults {
    kept: Mutex<BoundedReports>,
    listeners: Arc<Listeners>,
    metrics: Arc<Metrics>,
}

impl MemoryResults {
    /// Creates an empty store.
    pub fn new(limits: ResultLimits, metrics: Arc<Metrics>) -> Self {
        metrics.results_store_up.set(1);
        Self {
            listeners: Arc::new(Listeners::new(limits.max_listeners, Arc::clone(&metrics))),
            kept: Mutex::new(BoundedReports::new(limits)),
            metrics,
        }
    }

    /// Never removes these cameras for others.
    pub fn with_own(mut self, own: OwnCameras) -> Self {
        self.kept.get_mut().own = own;
        self
    }

    /// Keeps a report, possibly with its image, and publishes it to the listeners.
    pub fn store(&self, report: NewReport, image: Option<StoredFrame>) -> Arc<StoredReport> {
        // Published while the lock is held: listeners rely on the order.
        let mut kept = self.kept();
        let before = kept.removed_cameras;
        let stored = kept.add(report, image, Timestamp::now());
        self.metrics.results_stored.inc();
        self.listeners.notify(&stored);
        self.note_removals(&kept, before);
        stored
    }

    /// The reports that are not too old.
    fn kept(&self) -> MutexGuard<'_, BoundedReports> {
        // No change can panic before it is complete.
        let mut kept = self.kept.lock();
        let before = kept.removed_cameras;
        kept.expire(Timestamp::now());
        self.note_removals(&kept, before);
        kept
    }

    fn note_removals(&self, kept: &BoundedReports, before: u64) {
        if kept.removed_cameras > before {
            self.listeners.note_removal();
        }
    }
}

#[async_trait]
impl ResultStore for MemoryResults {
    fn publish(&self, report: NewReport, image: Option<StoredFrame>) {
        self.store(report, image);
    }

    async fn latest(&self, camera: &str) -> Result<Option<Arc<StoredReport>>, Unreachable> {
        Ok(self.kept().latest(camera))
    }

    async fn latest_of_all(&self) -> Result<Vec<Arc<StoredReport>>, Unreachable> {
        Ok(self.kept().latest.values().cloned().collect())
    }

    async fn cameras(&self) -> Result<Vec<String>, Unreachable> {
        Ok(self.kept().cameras.keys().cloned().collect())
    }

    async fn delete(&self, camera: &str) -> Result<bool, Unreachable> {
        let is_deleted = self.kept().delete(camera);
        if is_deleted {
            self.listeners.note_removal();
        }
        Ok(is_deleted)
    }

    async fn delete_image(&self, camera: &str) -> Result<(), Unreachable> {
        self.kept().images.remove(camera);
        Ok(())
    }

    fn expire(&self) {
        drop(self.kept());
    }

    async fn since(
        &self,
        cameras: &Cameras,
        after: ReportId,
        most: NonZeroUsize,
    ) -> Result<Vec<Arc<StoredReport>>, Unreachable> {
        Ok(self.kept().since(cameras, after, most.get()))
    }

    async fn image(&self, camera: &str) -> Result<Option<Arc<StoredImage>>, Unreachable> {
        Ok(self.kept().images.get(camera).cloned())
    }

    async fn listen(&self, client: &Client, to: Cameras) -> Result<Listening, ListenError> {
        self.listeners.listen(client, to)
    }

    fn listeners(&self) -> &Arc<Listeners> {
        &self.listeners
    }

    async fn usage(&self) -> Result<ResultUse, Unreachable> {
        Ok(self.kept().usage())
    }

    fn health(&self) -> StoreHealth {
        StoreHealth::default()
    }

    async fn flush(&self) {}
}

/// Reports within the limits. Every report is in `cameras`, and in exactly one of `latest` and
/// `earlier`.
#[derive(Debug)]
struct BoundedReports {
    limits: ResultLimits,
    /// Cameras that others do not displace.
    own: OwnCameras,
    /// The reports of each camera, oldest first, at least one.
    cameras: HashMap<String, VecDeque<Arc<StoredReport>>>,
    /// The latest report of every camera.
    latest: BTreeMap<ReportId, Arc<StoredReport>>,
    /// All other reports.
    earlier: BTreeMap<ReportId, Arc<StoredReport>>,
    /// The latest image of each camera that has one.
    images: HashMap<String, Arc<StoredImage>>,
    bytes: usize,
    newest: ReportId,
    /// The number of cameras that were removed.
    removed_cameras: u64,
}

impl BoundedReports {
    fn new(limits: ResultLimits) -> Self {
        Self {
            limits,
            own: OwnCameras::default(),
            cameras: HashMap::new(),
            images: HashMap::new(),
            latest: BTreeMap::new(),
            earlier: BTreeMap::new(),
            bytes: 0,
            newest: ReportId::default(),
            removed_cameras: 0,
        }
    }

    /// Keeps a report, and evicts reports until all limits hold.
    fn add(
        &mut self,
        report: NewReport,
        image: Option<StoredFrame>,
        now: Timestamp,
    ) -> Arc<StoredReport> {
        let id = ReportId::next(self.newest, now);
        let stored = Arc::new(StoredReport { id, report });
        self.newest = id;
        self.bytes += stored.report.bytes();
        let camera = &stored.report.camera;
        self.replace_image(camera, id, image);
        let reports = self.cameras.entry(camera.clone()).or_default();
        if let Some(before) = reports.back() {
            self.latest.remove(&before.id);
            self.earlier.insert(before.id, Arc::clone(before));
        }
        reports.push_back(Arc::clone(&stored));
        self.latest.insert(id, Arc::clone(&stored));
        if reports.len() > self.limits.history_per_camera.get() {
            self.forget_oldest_of(camera);
        }
        self.keep_limits();
        stored
    }

    /// Replaces the camera's image by that of the report with this ID, or removes it if that report
    /// has none. The camera that was silent for longest is evicted first, and those of this process
    /// last.
    fn replace_image(&mut self, camera: &str, id: ReportId, frame: Option<StoredFrame>) {
        let Some(frame) = frame else {
            self.images.remove(camera);
            return;
        };
        let stored = Arc::new(StoredImage { id, frame });
        self.images.insert(camera.to_owned(), stored);
        while self.images.len() > self.limits.max_images.get() {
            let images = self.images.iter();
            let is_own = |camera: &str| self.own.contains(camera);
            let oldest = images.min_by_key(|(camera, stored)| (is_own(camera), stored.id));
            if let Some(camera) = oldest.map(|(camera, _)| camera.clone()) {
                self.images.remove(&camera);
            }
        }
    }

    /// Removes the reports that are too old.
    fn expire(&mut self, now: Timestamp) {
        let Ok(max_age) = SignedDuration::try_from(self.limits.max_age) else {
            return;
        };
        let Ok(oldest) = now.checked_sub(max_age).map(ReportId::at) else {
            return;
        };
        while let Some(camera) = self.oldest_before(oldest) {
            self.forget_oldest_of(&camera);
        }
    }

    /// The camera of the oldest report, if that was stored before `id`.
    fn oldest_before(&self, id: ReportId) -> Option<String> {
        let earlier = self.earlier.first_key_value();
        let oldest = earlier.into_iter().chain(self.latest.first_key_value());
        let (oldest, report) = oldest.min_by_key(|(id, _)| **id)?;
        (*oldest < id).then(|| report.report.camera.clone())
    }

    /// Deletes all reports of a camera. Returns false if it had none.
    fn delete(&mut self, camera: &str) -> bool {
        let is_known = self.cameras.contains_key(camera);
        while self.forget_oldest_of(camera) {}
        is_known
    }

    fn keep_limits(&mut self) {
        while self.cameras.len() > self.limits.max_cameras.get()
            && let Some(silent) = self.oldest_of_others()
        {
            let camera = silent.report.camera.clone();
            while self.forget_oldest_of(&camera) {}
        }
        while (self.count() > self.limits.max_reports.get() || self.bytes > self.limits.max_bytes)
            && let Some(oldest) = self
                .earlier
                .values()
                .next()
                .or_else(|| self.oldest_of_others())
        {
            let camera = oldest.report.camera.clone();
            self.forget_oldest_of(&camera);
        }
    }

    /// Returns the oldest latest report of a camera that is not of this process, if there is one.
    fn oldest_of_others(&self) -> Option<&Arc<StoredReport>> {
        let mut latest = self.latest.values();
        let other = latest.find(|stored| !self.own.contains(&stored.report.camera));
        other.or_else(|| self.latest.values().next())
    }

    /// Removes the oldest report of the camera. Returns false if there was none.
    fn forget_oldest_of(&mut self, camera: &str) -> bool {
        let Some(reports) = self.cameras.get_mut(camera) else {
            return false;
        };
        if let Some(oldest) = reports.pop_front() {
            self.bytes -= oldest.report.bytes();
            self.latest.remove(&oldest.id);
            self.earlier.remove(&oldest.id);
        }
        if reports.is_empty() {
            self.cameras.remove(camera);
            self.images.remove(camera);
            self.removed_cameras += 1;
        }
        true
    }

    fn count(&self) -> usize {
        self.latest.len() + self.earlier.len()
    }

    fn latest(&self, camera: &str) -> Option<Arc<StoredReport>> {
        self.cameras.get(camera)?.back().cloned()
    }

    fn since(&self, cameras: &Cameras, after: ReportId, most: usize) -> Vec<Arc<StoredReport>> {
        match cameras {
            Cameras::One(camera) => {
                let Some(reports) = self.cameras.get(camera) else {
                    return Vec::new();
                };
                let first = reports.partition_point(|report| report.id <= after);
                reports.range(first..).take(most).cloned().collect()
            }
            Cameras::All => {
                let range = (Excluded(after), Unbounded);
                let [latest, earlier] =
                    [&self.latest, &self.earlier].map(|reports| reports.range(range).take(most));
                let mut found: Vec<_> = latest
                    .chain(earlier)
                    .map(|(_, found)| found.clone())
                    .collect();
                found.sort_unstable_by_key(|report| report.id);
                found.truncate(most);
                found
            }
        }
    }

    fn usage(&self) -> ResultUse {
        ResultUse {
            cameras: self.cameras.len(),
            reports: self.count(),
            bytes: self.bytes,
            images: self.images.len(),
        }
    }
}

#[cfg(test)]
mod tests;

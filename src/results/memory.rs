//! Reports in the memory of this process.

mod kept;

use std::{num::NonZeroUsize, sync::Arc};

use async_trait::async_trait;
use jiff::Timestamp;
use lookdown_common::OwnCameras;
use lookdown_detect::fairness::Client;
use parking_lot::{Mutex, MutexGuard};

use self::kept::BoundedReports;
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
        let before = kept.removed_cameras();
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
        let before = kept.removed_cameras();
        kept.expire(Timestamp::now());
        self.note_removals(&kept, before);
        kept
    }

    fn note_removals(&self, kept: &BoundedReports, before: u64) {
        if kept.removed_cameras() > before {
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
        Ok(self.kept().latest_of_all())
    }

    async fn cameras(&self) -> Result<Vec<String>, Unreachable> {
        Ok(self.kept().cameras())
    }

    async fn delete(&self, camera: &str) -> Result<bool, Unreachable> {
        let is_deleted = self.kept().delete(camera);
        if is_deleted {
            self.listeners.note_removal();
        }
        Ok(is_deleted)
    }

    async fn delete_image(&self, camera: &str) -> Result<(), Unreachable> {
        self.kept().delete_image(camera);
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
        Ok(self.kept().image(camera))
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

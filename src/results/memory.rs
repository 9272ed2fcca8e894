//! Reports in the memory of this process.

mod kept;

use std::{
    num::NonZeroUsize,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use async_trait::async_trait;
use jiff::Timestamp;

use self::kept::Kept;
use super::{
    Cameras, Listeners, NewReport, ReportId, ResultLimits, ResultStore, ResultUse, StoredReport,
};

/// Keeps reports in memory, within limits; they go when the process ends.
#[derive(Debug)]
pub struct MemoryResults {
    kept: Mutex<Kept>,
    listeners: Arc<Listeners>,
}

impl MemoryResults {
    /// An empty store.
    #[must_use]
    pub fn new(limits: ResultLimits) -> Self {
        Self {
            listeners: Arc::new(Listeners::new(limits.max_listeners)),
            kept: Mutex::new(Kept::new(limits)),
        }
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        // No change can panic half-way.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[async_trait]
impl ResultStore for MemoryResults {
    async fn publish(&self, report: NewReport) -> Arc<StoredReport> {
        // Told while nobody else can publish: listeners rely on the order.
        let mut kept = self.kept();
        let stored = kept.add(report, Timestamp::now());
        self.listeners.tell(&stored);
        stored
    }

    async fn latest(&self, camera: &str) -> Option<Arc<StoredReport>> {
        self.kept().latest(camera)
    }

    async fn latest_of_all(&self) -> Vec<Arc<StoredReport>> {
        self.kept().latest_of_all()
    }

    async fn since(
        &self,
        cameras: &Cameras,
        after: ReportId,
        most: NonZeroUsize,
    ) -> Vec<Arc<StoredReport>> {
        self.kept().since(cameras, after, most.get())
    }

    fn listeners(&self) -> &Arc<Listeners> {
        &self.listeners
    }

    async fn usage(&self) -> ResultUse {
        self.kept().usage()
    }
}

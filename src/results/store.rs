//! What a place for reports can do.

use std::{num::NonZeroUsize, sync::Arc};

use async_trait::async_trait;

use super::{Listeners, NewReport, ReportId, StoredReport};

/// Whose reports.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Cameras {
    /// Every camera's.
    All,
    /// This camera's.
    One(String),
}

/// A place for reports. What it gives back is shared, not copied.
#[async_trait]
pub trait ResultStore: Send + Sync {
    /// Keeps a report, gives it the next ID, and tells whoever listens, in the order of the IDs.
    async fn publish(&self, report: NewReport) -> Arc<StoredReport>;

    /// The latest report of a camera, if it has one.
    async fn latest(&self, camera: &str) -> Option<Arc<StoredReport>>;

    /// The latest report of every camera, in the order of their IDs.
    async fn latest_of_all(&self) -> Vec<Arc<StoredReport>>;

    /// The first reports after `after` that are still kept, oldest first, `most` of them at most.
    async fn since(
        &self,
        cameras: &Cameras,
        after: ReportId,
        most: NonZeroUsize,
    ) -> Vec<Arc<StoredReport>>;

    /// Who listens to what is published, here or on another server with the same store.
    fn listeners(&self) -> &Arc<Listeners>;

    /// What is kept.
    async fn usage(&self) -> ResultUse;
}

/// What is kept at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ResultLimits {
    /// Cameras; the one that has been silent for longest goes first.
    pub max_cameras: NonZeroUsize,
    /// Reports of one camera, the latest among them.
    pub history_per_camera: NonZeroUsize,
    /// Reports of all cameras; the oldest that is not its camera's latest goes first.
    pub max_reports: NonZeroUsize,
    /// Bytes of all reports, in the same way.
    pub max_bytes: usize,
    /// Listeners at the same time.
    pub max_listeners: NonZeroUsize,
}

impl Default for ResultLimits {
    /// A hundred reports of a hundred cameras, and the latest of many more.
    fn default() -> Self {
        let count = |number| NonZeroUsize::new(number).unwrap_or(NonZeroUsize::MIN);
        Self {
            max_cameras: count(1000),
            history_per_camera: count(100),
            max_reports: count(10_000),
            max_bytes: 64 << 20,
            max_listeners: count(256),
        }
    }
}

/// What is kept now, and what came so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ResultUse {
    /// Cameras with a report.
    pub cameras: usize,
    /// Their reports.
    pub reports: usize,
    /// How much memory those take, bytes.
    pub bytes: usize,
    /// Reports that were ever published here.
    pub published: u64,
}

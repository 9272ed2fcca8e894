//! What a place for reports can do.

use std::{num::NonZeroUsize, sync::Arc};

use async_trait::async_trait;

use super::{Listeners, NewPicture, NewReport, ReportId, StoredPicture, StoredReport};

/// Whose reports.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Cameras {
    /// Every camera's.
    All,
    /// This camera's.
    One(String),
}

/// The place where reports are kept does not answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the place of the results does not answer: {0}")]
pub struct Unreachable(pub String);

/// A place for reports. What it gives back is shared, not copied.
#[async_trait]
pub trait ResultStore: Send + Sync {
    /// Keeps a report, gives it the next ID, and tells whoever listens, in the order of the IDs. Nobody
    /// waits for that: a place that is elsewhere has it a little later. The picture takes the place of
    /// the one before; so does none.
    fn publish(&self, report: NewReport, picture: Option<NewPicture>);

    /// The latest report of a camera, if it has one.
    ///
    /// # Errors
    /// [`Unreachable`], as of all that is read.
    async fn latest(&self, camera: &str) -> Result<Option<Arc<StoredReport>>, Unreachable>;

    /// The latest report of every camera, in the order of their IDs.
    ///
    /// # Errors
    /// [`Unreachable`].
    async fn latest_of_all(&self) -> Result<Vec<Arc<StoredReport>>, Unreachable>;

    /// The first reports after `after` that are still kept, oldest first, `most` of them at most.
    ///
    /// # Errors
    /// [`Unreachable`].
    async fn since(
        &self,
        cameras: &Cameras,
        after: ReportId,
        most: NonZeroUsize,
    ) -> Result<Vec<Arc<StoredReport>>, Unreachable>;

    /// The picture of a camera's latest report, if it is kept.
    ///
    /// # Errors
    /// [`Unreachable`].
    async fn picture(&self, camera: &str) -> Result<Option<Arc<StoredPicture>>, Unreachable>;

    /// Who listens to what is published, here or on another server with the same store.
    fn listeners(&self) -> &Arc<Listeners>;

    /// What is kept.
    ///
    /// # Errors
    /// [`Unreachable`].
    async fn usage(&self) -> Result<ResultUse, Unreachable>;

    /// What became of what was published here.
    fn health(&self) -> StoreHealth;

    /// Waits until what was published here is kept, but not for a place that does not answer.
    async fn flush(&self);
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
    /// Cameras with a picture; the one that has been silent for longest loses its.
    pub max_pictures: NonZeroUsize,
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
            max_pictures: count(64),
            max_listeners: count(256),
        }
    }
}

/// What is kept now.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ResultUse {
    /// Cameras with a report.
    pub cameras: usize,
    /// Their reports.
    pub reports: usize,
    /// How much memory those take, bytes.
    pub bytes: usize,
    /// Cameras with a picture.
    pub pictures: usize,
}

/// What became of the reports that were published here.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct StoreHealth {
    /// Why their place cannot be reached, if it cannot.
    pub problem: Option<String>,
    /// How many were ever kept.
    pub stored: u64,
    /// How many never will be: too many waited, or their place refused them.
    pub dropped: u64,
    /// How many wait to be kept.
    pub waiting: usize,
}

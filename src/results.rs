//! The result store: the latest report of each camera and some earlier ones, for later queries and
//! for live streams. A report is stored as the exact bytes that answered its frame.
//!
//! The interface of a result store.
//!
//! An image that is kept for a camera, and the set of cameras whose images may be kept.

mod headline;
mod listeners;
mod memory;
mod redis;
mod report;

use std::{collections::BTreeSet, num::NonZeroUsize, sync::Arc, time::Duration};

use async_trait::async_trait;
use lookdown_detect::fairness::Client;

pub use headline::{FollowedPersons, Headline, HeadlineSource, MEDIAN_WINDOW, medians};
pub use listeners::{ListenError, Listeners, Listening, Unreachable};
pub use memory::MemoryResults;
pub use redis::{RedisAddress, RedisAddressError, RedisOptions, RedisResults};
pub use report::{Cameras, NewReport, ReportId, StoredReport};

use crate::annotated_image::StoredFrame;

/// A result store. Its return values are shared, not copied.
#[async_trait]
pub trait ResultStore: Send + Sync {
    /// Stores a report under the next ID and publishes it to the listeners, in the order of the
    /// IDs. The caller does not wait: a remote store has the report a little later. The image
    /// replaces the camera's previous one. A report without an image removes that.
    fn publish(&self, report: NewReport, image: Option<StoredFrame>);

    /// The latest report of a camera, if it has one.
    ///
    /// # Errors
    /// [`Unreachable`], as for all queries.
    async fn latest(&self, camera: &str) -> Result<Option<Arc<StoredReport>>, Unreachable>;

    /// The latest report of every camera, in the order of their IDs.
    ///
    /// # Errors
    /// [`Unreachable`].
    async fn latest_of_all(&self) -> Result<Vec<Arc<StoredReport>>, Unreachable>;

    /// The names of the cameras with a report.
    ///
    /// # Errors
    /// [`Unreachable`].
    async fn cameras(&self) -> Result<Vec<String>, Unreachable>;

    /// Deletes all reports of a camera and its image. Returns false if it had none.
    ///
    /// # Errors
    /// [`Unreachable`].
    async fn delete(&self, camera: &str) -> Result<bool, Unreachable>;

    /// Deletes the image of a camera.
    ///
    /// # Errors
    /// [`Unreachable`].
    async fn delete_image(&self, camera: &str) -> Result<(), Unreachable>;

    /// Removes the reports that are too old from the memory of this process. A store elsewhere
    /// does that itself.
    fn expire(&self) {}

    /// The first reports after `after` that are still stored, oldest first, at most `most`.
    async fn since(
        &self,
        cameras: &Cameras,
        after: ReportId,
        most: NonZeroUsize,
    ) -> Result<Vec<Arc<StoredReport>>, Unreachable>;

    /// The image of the camera's latest report, if it is stored.
    ///
    /// # Errors
    /// [`Unreachable`].
    async fn image(&self, camera: &str) -> Result<Option<Arc<StoredImage>>, Unreachable>;

    /// Adds a listener that receives every report of these cameras that is stored after this
    /// returns, and perhaps some that were stored before.
    ///
    /// # Errors
    /// [`ListenError`] when there are too many listeners, the store does not answer, or the server
    /// is shutting down.
    async fn listen(&self, client: &Client, to: Cameras) -> Result<Listening, ListenError>;

    /// The listeners to what is published, here or on another server with the same store.
    fn listeners(&self) -> &Arc<Listeners>;

    /// The current use of the store.
    ///
    /// # Errors
    /// [`Unreachable`].
    async fn usage(&self) -> Result<ResultUse, Unreachable>;

    /// Returns the health of the store.
    fn health(&self) -> StoreHealth;

    /// Waits until everything published here is stored. Does not wait for a store that does not
    /// answer.
    async fn flush(&self);
}

/// The limits of the store.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ResultLimits {
    /// Most cameras. The one that has been silent for longest is evicted first.
    pub max_cameras: NonZeroUsize,
    /// Most reports of one camera, including its latest.
    pub history_per_camera: NonZeroUsize,
    /// Most reports of all cameras. The oldest one that is not its camera's latest is evicted
    /// first.
    pub max_reports: NonZeroUsize,
    /// Most bytes of all reports, evicted in the same order.
    pub max_bytes: usize,
    /// Longest time for which a report is stored.
    pub max_age: Duration,
    /// Most cameras with an image. The one that has been silent for longest loses its image first.
    pub max_images: NonZeroUsize,
    /// Most listeners at the same time.
    pub max_listeners: NonZeroUsize,
}

impl Default for ResultLimits {
    /// A hundred reports of each of a hundred cameras, and the latest report of many more, for a
    /// day.
    fn default() -> Self {
        let count = |number| NonZeroUsize::new(number).unwrap_or(NonZeroUsize::MIN);
        Self {
            max_cameras: count(1000),
            history_per_camera: count(100),
            max_reports: count(10_000),
            max_bytes: 64 << 20,
            max_age: Duration::from_hours(24),
            max_images: count(64),
            max_listeners: count(256),
        }
    }
}

/// The current use of a store.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ResultUse {
    /// The number of cameras with a report.
    pub cameras: usize,
    /// The number of their reports.
    pub reports: usize,
    /// The memory that the reports take, bytes.
    pub bytes: usize,
    /// The number of cameras with an image.
    pub images: usize,
}

/// The health of a store.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct StoreHealth {
    /// The reason why the store cannot be reached, if it cannot.
    pub problem: Option<String>,
    /// The number of reports that wait to be stored.
    pub waiting: usize,
}

/// A kept image: that of its camera's latest report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredImage {
    /// The ID of its report.
    pub id: ReportId,
    /// The frame of its report.
    pub frame: StoredFrame,
}

/// The cameras whose images are kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ImagesOf {
    /// Every camera.
    All,
    /// These cameras, possibly none.
    Some(BTreeSet<String>),
}

impl ImagesOf {
    /// Returns true if the image of this camera may be kept.
    pub fn include(&self, camera: &str) -> bool {
        match self {
            Self::All => true,
            Self::Some(cameras) => cameras.contains(camera),
        }
    }
}

impl Default for ImagesOf {
    /// No cameras: images show people.
    fn default() -> Self {
        Self::Some(BTreeSet::new())
    }
}

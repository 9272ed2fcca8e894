//! The result store: the latest report of each camera and some earlier ones, for later queries and
//! for live streams. A report is stored as the exact bytes that answered its frame.

mod cameras;
mod followed_persons;
mod headline;
mod listeners;
mod memory;
mod redis;
mod report;
mod store;
mod stored_image;
mod unreachable;

pub use cameras::Cameras;
pub use followed_persons::FollowedPersons;
pub use headline::{Headline, HeadlineSource, MEDIAN_WINDOW, medians};
pub use listeners::{ListenError, Listeners, Listening};
pub use memory::MemoryResults;
pub use redis::{RedisAddress, RedisAddressError, RedisOptions, RedisResults};
pub use report::{NewReport, ReportId, StoredReport};
pub use store::{ResultLimits, ResultStore, ResultUse, StoreHealth};
pub use stored_image::{ImagesOf, StoredImage};
pub use unreachable::Unreachable;

//! The result store: the latest report of each camera and some earlier ones, for later queries and
//! for live streams. A report is stored as the exact bytes that answered its frame.

mod headline;
mod listeners;
mod memory;
mod redis;
mod report;
mod store;

pub use headline::{FollowedPersons, Headline, HeadlineSource, MEDIAN_WINDOW, medians};
pub use listeners::{ListenError, Listeners, Listening, Unreachable};
pub use memory::MemoryResults;
pub use redis::{RedisAddress, RedisAddressError, RedisOptions, RedisResults};
pub use report::{Cameras, NewReport, ReportId, StoredReport};
pub use store::{ImagesOf, ResultLimits, ResultStore, ResultUse, StoreHealth, StoredImage};

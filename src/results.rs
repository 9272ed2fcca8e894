//! What was found last: the latest report of each camera and some before it, for whoever asks later
//! or listens. A report is the bytes that its sender was answered, whatever they say.

mod listeners;
mod memory;
mod picture;
mod redis;
mod report;
mod store;

pub use listeners::{ListenError, Listeners, Listening};
pub use memory::MemoryResults;
pub use picture::{NewPicture, PicturesOf, StoredPicture};
pub use redis::{RedisAddress, RedisAddressError, RedisOptions, RedisResults};
pub use report::{NewReport, ReportId, StoredReport};
pub use store::{Cameras, ResultLimits, ResultStore, ResultUse, StoreHealth, Unreachable};

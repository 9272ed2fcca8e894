//! Follows the reports of a Lookdown server and counts persons over time: tracks, lines, zones.
//!
//! A client of the public HTTP API; depends on no code of the server.
//!
//! The pure core: [`tracking`] turns [`Observation`]s into tracks, [`lines`] counts crossings,
//! [`zones`] occupancy and dwell times, [`heat_map`] seconds of presence. It does no I/O. All its
//! state is serializable, so that it can be stored together with the counts.
//!
//! Around it: the follower reads `/events` and feeds the engine, the store keeps sums per minute with
//! the state and the ID of the last report, and the HTTP API answers from both.

mod calibrations;
#[cfg(test)]
mod clock_simulation;
mod definition;
mod drops;
mod engine;
mod event_parser;
mod event_stream;
mod follower;
pub mod heat_map;
mod http;
pub mod lines;
mod metrics;
mod now;
mod observation;
mod options;
mod presence;
mod recording;
mod report;
mod run;
mod scene;
mod site;
mod snapshot;
mod store;
mod sums;
#[cfg(test)]
mod test_walks;
pub mod tracking;
mod webhooks;
pub mod zones;

pub use observation::Observation;
pub use options::{CountEntry, CountOptions, read_key};
pub use recording::{Recording, RecordingError};
pub use run::{CountError, Started, count};
pub use site::CameraPose;
pub use snapshot::{CameraSnapshot, LineSnapshot, SiteSnapshot, Snapshot, ZoneSnapshot};
pub use store::StoreError;
pub use webhooks::WebhookEntry;

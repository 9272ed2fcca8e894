//! Follows the reports of a Lookdown server and counts persons over time: tracks, lines, zones.
//!
//! A client of the public HTTP API; depends on no code of the server.
//!
//! The pure core is [`lookdown_tracking`], whose state is serializable, so that it can be stored
//! together with the counts.
//!
//! Around it: the follower reads `/events` and feeds the counter, the store keeps sums per minute
//! with the state and the ID of the last report, and the HTTP API answers from both.

mod bars;
mod calibrations;
#[cfg(test)]
mod clock_simulation;
mod counter;
mod definition;
mod drops;
mod event_image;
mod event_parser;
mod floor;
mod follower;
mod http;
mod metrics;
mod now;
mod options;
mod presence;
mod recording;
mod remote_persons;
mod report;
mod run;
mod scene;
mod scene_camera;
mod snapshot;
mod store;
mod sums;
mod webhooks;

pub use event_image::latest_image;
pub use http::openapi_document;
pub use options::{CountEntry, CountOptions, read_key};
pub use recording::{Recording, RecordingError};
pub use remote_persons::{PersonsByCamera, read_persons};
pub use run::{CountError, Started, count};
pub use snapshot::{
    CameraSnapshot, FloorAlert, LineSnapshot, SiteSnapshot, Snapshot, ZoneSnapshot,
};
pub use store::StoreError;
pub use webhooks::WebhookEntry;

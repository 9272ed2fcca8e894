//! Follows the reports of a Lookdown server and counts persons over time: tracks, lines, zones.
//!
//! A client of the public HTTP API; depends on no code of the server.

mod observation;

pub use observation::Observation;

//! Follows the reports of a Lookdown server and counts persons over time: tracks, lines, zones.
//!
//! A client of the public HTTP API; depends on no code of the server.
//!
//! The pure core: [`tracking`] turns [`Observation`]s into tracks, [`lines`] counts crossings,
//! [`zones`] occupancy and dwell times, [`heat_map`] seconds of presence. It does no I/O. All its
//! state is serializable, so that it can be stored together with the counts.

pub mod heat_map;
pub mod lines;
mod observation;
mod site;
#[cfg(test)]
mod test_walks;
pub mod tracking;
pub mod zones;

pub use observation::Observation;
pub use site::CameraPose;

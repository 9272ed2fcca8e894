#![doc = include_str!("../README.md")]
//!
//! [`Tracker`] turns [`Observation`]s into tracks, [`lines`] counts crossings, [`zones`] occupancy
//! and dwell times, [`heat_map`] seconds of presence. [`furniture`] is what never moves. [`follow`]
//! tells where to look for people between searches of a frame. [`taught`] is the number of a
//! camera with its error bar, and that of a line.

mod camera;
mod candidates;
mod evidence;
pub mod follow;
pub mod furniture;
pub mod heat_map;
mod kalman;
pub mod lines;
mod measurement;
mod motion;
mod reappearance;
mod relative_pose;
mod settings;
mod site;
pub mod taught;
#[cfg(test)]
mod test_walks;
mod track;
mod tracker;
pub mod zones;

pub use candidates::MAX_PERSONS;
pub use evidence::EvidenceSettings;
pub use heat_map::{LEAST_WALKED_M2, walked_area};
pub use measurement::Observation;
pub use relative_pose::{NoPose, RelativePose, Walk, relative_pose};
pub use settings::{MeasurementNoise, PlaneSettings, TrackerSettings};
pub use site::{CameraPose, Plane};
pub use track::{MAX_TAIL_POINTS, PersonOfReport, TailPoint, Track, TrackId};
pub use tracker::{MAX_CAMERAS, RefusedReport, SiteError, Tracker};

#[cfg(test)]
mod tests;

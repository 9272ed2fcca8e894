//! Tracks of anonymous persons from the reports of one camera, or of all cameras of a site.
//!
//! Each track is a constant-velocity Kalman filter: on the floor in metres where every camera has
//! its height, else on the unit sphere around the camera. Reports are associated in two stages as in
//! `ByteTrack` (Zhang et al., ECCV 2022). No appearance is used: tracks are anonymous.

mod assignment;
mod camera;
mod duplicates;
mod evidence;
mod kalman;
mod measurement;
mod motion;
mod settings;
mod track;
mod tracker;

use serde::{Deserialize, Serialize};

pub use evidence::EvidenceSettings;
pub use settings::{MeasurementNoise, PlaneSettings, TrackerSettings};
pub use track::{MAX_TAIL_POINTS, PersonOfReport, TailPoint, Track};
pub use tracker::{MAX_CAMERAS, MAX_PERSONS, RefusedReport, SiteError, Tracker};

/// Identifies a track within its tracker; never used twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TrackId(pub u64);

/// The plane in which a line or zone is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Plane {
    /// Metres on the floor of the site, or of the camera where it is alone.
    FloorM,
    /// Corner-origin frame pixels. Only for a camera that has its tracker to itself.
    FramePx,
}

#[cfg(test)]
mod tests;

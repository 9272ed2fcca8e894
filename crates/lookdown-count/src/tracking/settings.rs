//! Settings of the tracker, with their units.

use serde::{Deserialize, Serialize};

use super::measurement::Place;

/// Settings of a tracker. The defaults are tuned on simulated walks (`docs/count-accuracy.md`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackerSettings {
    /// Persons from this score on are associated first.
    pub high_score: f64,
    /// Persons below this score are ignored; those in between continue tracks that lack a person.
    pub low_score: f64,
    /// Least score of a person that starts a track.
    pub new_track_score: f64,
    /// Sum of the scores of its persons from which on a track is confirmed.
    pub confirm_score_sum: f64,
    /// Least number of persons of a confirmed track.
    pub confirm_hits: u32,
    /// A confirmed track ends after this many seconds without a person, and `max_missed` misses.
    pub max_unseen_s: f64,
    /// Least number of reports without its person before a confirmed track ends.
    pub max_missed: u32,
    /// A track ends after this many seconds without a person, whatever the cameras report.
    pub max_silent_s: f64,
    /// A report may be this many seconds older than the newest one of the site.
    pub max_lateness_s: f64,
    /// Most tracks at any time; persons beyond them start none.
    pub max_tracks: usize,
    /// Noise of the measured places.
    pub noise: MeasurementNoise,
    /// Motion on the floor, in metres.
    pub floor: PlaneSettings,
    /// Motion in bearing space, in radians.
    pub bearing: PlaneSettings,
}

/// Standard deviations of a measured place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasurementNoise {
    /// Distance of the measured foot point from the body's axis, metres.
    pub body_m: f64,
    /// Angle of the foot point, degrees.
    pub angle_deg: f64,
    /// Angle of the person's centre in bearing space, degrees.
    pub bearing_deg: f64,
}

/// Motion and association in one kind of plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlaneSettings {
    /// Spectral density of the acceleration: square units per cubic second.
    pub acceleration_density: f64,
    /// Standard deviation of the velocity of a new track, units per second.
    pub velocity_sd: f64,
    /// Density of false and new persons: number per square unit of a frame.
    pub clutter_density: f64,
    /// Persons nearer to a track than this start no other track, units.
    pub least_distance: f64,
}

impl TrackerSettings {
    /// Returns the motion in the plane of a measured place.
    pub(super) fn plane_of(&self, place: &Place) -> &PlaneSettings {
        match place {
            Place::Floor(_) => &self.floor,
            Place::Bearing(_) => &self.bearing,
        }
    }
}

impl Default for TrackerSettings {
    fn default() -> Self {
        Self {
            high_score: 0.5,
            low_score: 0.1,
            new_track_score: 0.4,
            confirm_score_sum: 1.2,
            confirm_hits: 2,
            max_unseen_s: 2.0,
            max_missed: 3,
            max_silent_s: 10.0,
            max_lateness_s: 2.0,
            max_tracks: 512,
            noise: MeasurementNoise {
                body_m: 0.15,
                angle_deg: 1.0,
                bearing_deg: 1.5,
            },
            floor: PlaneSettings {
                acceleration_density: 0.6,
                velocity_sd: 1.0,
                clutter_density: 0.02,
                least_distance: 0.3,
            },
            bearing: PlaneSettings {
                acceleration_density: 0.05,
                velocity_sd: 0.3,
                clutter_density: 0.5,
                least_distance: 0.06,
            },
        }
    }
}

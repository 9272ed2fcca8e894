//! Settings of the tracker, with their units.

use nalgebra::{Unit, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::evidence::EvidenceSettings;

/// Settings of a tracker. The defaults are tuned on simulated walks (`docs/lab/count-accuracy.md`),
/// the errors of places on those of real people (`docs/lab/real-walks.md`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TrackerSettings {
    /// Persons from this score on are associated first.
    pub high_score: f64,
    /// Persons below this score are ignored; those in between continue tracks that lack a person.
    pub low_score: f64,
    /// Least score of a person that starts a track.
    pub new_track_score: f64,
    /// Persons below this score are ignored in line with a person of a higher score.
    pub least_score_in_line: f64,
    /// Least score of a person that starts a track in line with a person already tracked.
    pub new_track_score_in_line: f64,
    /// A confirmed track ends after this many seconds without a person, and `max_missed` misses.
    pub max_unseen_s: f64,
    /// Least number of reports without its person before a confirmed track ends.
    pub max_missed: u32,
    /// A track ends after this many seconds without a person, whatever the cameras report.
    pub max_silent_s: f64,
    /// A person who comes back within this many seconds continues the track that ended, where that
    /// is likelier than a new person.
    pub max_absent_s: f64,
    /// Growth of the variance of the place of such a person who stood: square meters per second.
    pub absent_drift: f64,
    /// Density of new persons in such a time, number per square meter.
    pub arrival_density: f64,
    /// A report may be this many seconds older than the newest one of the site.
    pub max_lateness_s: f64,
    /// Most tracks at any time; persons beyond them start none.
    pub max_tracks: usize,
    /// Share of a score's log odds in the gain of an association.
    pub score_share: f64,
    /// Noise of the measured places.
    pub noise: MeasurementNoise,
    /// Evidence that confirms and ends tracks.
    pub evidence: EvidenceSettings,
    /// Motion on the floor, in meters.
    pub floor: PlaneSettings,
    /// Motion in bearing space, in radians.
    pub bearing: PlaneSettings,
}

/// Standard deviations of a measured place, and the reach of a person's further boxes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct MeasurementNoise {
    /// Distance of the foot point from the place of the body, meters.
    pub body_m: f64,
    /// Added to it straight below the camera, meters.
    pub below_m: f64,
    /// Distance from the point below the camera at which nothing is added, meters.
    pub below_range_m: f64,
    /// Angle of the foot point off the axis, degrees.
    pub angle_deg: f64,
    /// Angle of the foot point around the axis, degrees.
    pub across_deg: f64,
    /// Error of the place that lasts, per camera and person: of the place of the body, meters.
    pub bias_body_m: f64,
    /// Lasting error of the angle of the foot point off the axis, degrees.
    pub bias_angle_deg: f64,
    /// Lasting error of the angle of the foot point around the axis, degrees.
    pub bias_across_deg: f64,
    /// Distance from the lower end of a box out to the body's axis, meters.
    pub foot_offset_m: f64,
    /// Angle of the person's center off the axis in bearing space, degrees.
    pub bearing_along_deg: f64,
    /// Angle of the person's center around the axis in bearing space, degrees.
    pub bearing_across_deg: f64,
    /// Growth of the deviations toward a score of 0: they are 1 + this factor times as large.
    pub low_score_factor: f64,
    /// Boxes nearer than this show one person, meters.
    pub same_person_m: f64,
    /// Added to that radially, as a share of the distance from the camera.
    pub same_person_share: f64,
    /// Boxes nearer than this off the axis show one person in bearing space, degrees.
    pub same_person_along_deg: f64,
    /// Boxes nearer than this around the axis show one person in bearing space, degrees.
    pub same_person_across_deg: f64,
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
    /// A person who has moved this far looks different, units.
    pub independent_distance: f64,
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
            high_score: 0.08,
            low_score: 0.06,
            new_track_score: 0.35,
            least_score_in_line: 0.47,
            new_track_score_in_line: 0.85,
            max_unseen_s: 2.0,
            max_missed: 2,
            max_silent_s: 10.0,
            max_absent_s: 120.0,
            absent_drift: 0.02,
            arrival_density: 0.01,
            max_lateness_s: 2.0,
            max_tracks: 512,
            score_share: 0.4,
            noise: MeasurementNoise::default(),
            evidence: EvidenceSettings::default(),
            floor: PlaneSettings {
                acceleration_density: 0.6,
                velocity_sd: 0.9,
                clutter_density: 0.025,
                independent_distance: 0.5,
            },
            bearing: PlaneSettings {
                acceleration_density: 0.034,
                velocity_sd: 0.35,
                clutter_density: 0.19,
                independent_distance: 0.17,
            },
        }
    }
}

impl Default for MeasurementNoise {
    fn default() -> Self {
        Self {
            body_m: 0.15,
            below_m: 0.22,
            below_range_m: 0.8,
            angle_deg: 3.0,
            across_deg: 0.4,
            bias_body_m: 0.2,
            bias_angle_deg: 3.0,
            bias_across_deg: 0.4,
            foot_offset_m: 0.12,
            bearing_along_deg: 1.3,
            bearing_across_deg: 0.8,
            low_score_factor: 2.0,
            same_person_m: 0.4,
            same_person_share: 0.19,
            same_person_along_deg: 12.0,
            same_person_across_deg: 4.3,
        }
    }
}

/// A measured place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// Meters on the site's floor.
    Floor(Vector2<f64>),
    /// A direction in the camera's frame.
    Bearing(Unit<Vector3<f64>>),
}

//! One track: its motion, its evidence and its recent places.

use std::collections::{BTreeMap, VecDeque};

use lookdown_lens::geometry::{Posture, PostureBelief, PostureSigns};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::{
    Plane, TrackerSettings, candidates::Candidate, evidence::Evidence, furniture::START_AFTER_S,
    motion::Motion,
};

/// Most places that a track keeps.
pub const MAX_TAIL_POINTS: usize = 64;

/// A confirmed or possible person over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// The track's identifier.
    pub id: TrackId,
    pub(super) motion: Motion,
    /// The time of the first observation, seconds since the Unix epoch.
    pub first_seen_s: f64,
    /// The time of the last observation, seconds since the Unix epoch.
    pub seen_s: f64,
    pub(super) evidence: Evidence,
    /// The place at which the present evidence began.
    evidence_place: [f64; 3],
    /// True once the evidence has begun again at another place.
    has_moved: bool,
    pub(super) missed: u32,
    confirmed: bool,
    /// The person of the report that updated the track last.
    pub last_person: PersonOfReport,
    foot_px: [f64; 2],
    /// The center of the last box in the frame that showed it, pixels.
    pub center_px: [f64; 2],
    /// The longer side of the last box.
    pub length_px: f64,
    /// True while the last person was in the margin of an area.
    #[serde(default)]
    in_margin: bool,
    posture: PostureBelief,
    /// The time of the last person of each camera that saw the track.
    pub(super) seen_by: BTreeMap<usize, f64>,
    tail: VecDeque<TailPoint>,
}

/// A person's place in a report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PersonOfReport {
    /// Number of the camera in its tracker.
    pub camera: usize,
    /// Index of the person in the report.
    pub person: usize,
}

/// A past place of a track.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TailPoint {
    /// Time of the frame, seconds since the Unix epoch.
    pub at_s: f64,
    /// Filtered place on the floor, meters; absent in bearing space.
    pub floor_m: Option<[f64; 2]>,
    /// Foot point in the frame of the camera that saw the person, pixels.
    pub foot_px: [f64; 2],
}

impl TailPoint {
    /// Returns the place in a plane; `None` for the floor in bearing space.
    pub fn place(&self, plane: Plane) -> Option<[f64; 2]> {
        match plane {
            Plane::FloorM => self.floor_m,
            Plane::FramePx => Some(self.foot_px),
        }
    }
}

/// The report that updates the tracks.
pub(super) struct CurrentReport {
    pub camera: usize,
    pub at_s: f64,
    /// Time since the camera's last report, seconds; infinite for its first one.
    pub interval_s: f64,
    /// Time since the last report of any camera, seconds; 0 for the first one.
    pub unwatched_s: f64,
    /// Height of the camera above the floor, meters.
    pub camera_m: Option<f64>,
}

impl CurrentReport {
    /// Returns true when a person of this report continued or started the track.
    pub(super) fn shows(&self, track: &Track) -> bool {
        track.seen_by.get(&self.camera) == Some(&self.at_s)
    }

    fn person(&self, seen: &Candidate) -> PersonOfReport {
        PersonOfReport {
            camera: self.camera,
            person: seen.index,
        }
    }
}

impl Track {
    /// Returns a new track, not confirmed yet.
    pub(super) fn new(
        id: TrackId,
        report: &CurrentReport,
        seen: &Candidate,
        settings: &TrackerSettings,
    ) -> Self {
        let plane = settings.plane_of(&seen.measured.place);
        let motion = Motion::new(&seen.measured, report.at_s, plane);
        let settings = &settings.evidence;
        let mut track = Self {
            id,
            evidence_place: motion.place().into(),
            has_moved: false,
            motion,
            first_seen_s: report.at_s,
            seen_s: report.at_s,
            evidence: Evidence::first(seen.measured.score, report.unwatched_s, settings),
            missed: 0,
            confirmed: false,
            last_person: report.person(seen),
            foot_px: seen.person.foot_px,
            center_px: seen.person.center_px,
            length_px: 0.0,
            in_margin: seen.person.is_in_margin,
            posture: PostureBelief::new(report.camera_m.is_some()),
            seen_by: BTreeMap::new(),
            tail: VecDeque::new(),
        };
        track.confirmed = track.evidence.confirms(settings);
        track.record(report, seen);
        track
    }

    /// Updates the track with a person.
    pub(super) fn update(
        &mut self,
        report: &CurrentReport,
        seen: &Candidate,
        settings: &TrackerSettings,
    ) {
        let plane = settings.plane_of(&seen.measured.place);
        self.motion.update(&seen.measured, report.at_s, plane);
        let settings = &settings.evidence;
        let here = self.motion.place();
        if (here - Vector3::from(self.evidence_place)).norm() >= plane.independent_distance {
            self.evidence_place = here.into();
            self.has_moved = true;
            self.evidence.move_on(settings);
        }
        self.evidence
            .add_hit(seen.measured.score, report.interval_s, settings);
        self.confirmed |= self.evidence.confirms(settings);
        self.record(report, seen);
    }

    /// Continues a track that was last seen before this one began: takes its identifier, and comes
    /// from its last place.
    pub(super) fn continue_from(&mut self, earlier: &Self) {
        self.id = earlier.id;
        self.first_seen_s = earlier.first_seen_s;
        self.has_moved |= earlier.has_moved;
        if let (Some(first), Some(last)) = (self.tail.front(), earlier.tail.back()) {
            // Just before, so that lines and zones do not count the time between.
            let at_s = last.at_s.max(first.at_s - 1e-3);
            self.tail.push_front(TailPoint { at_s, ..*last });
            self.tail.truncate(MAX_TAIL_POINTS);
        }
    }

    fn record(&mut self, report: &CurrentReport, seen: &Candidate) {
        self.missed = 0;
        let person = seen.person;
        if person.signs != PostureSigns::default() {
            if !self.seen_by.is_empty() {
                self.posture.pass(report.at_s - self.seen_s);
            }
            let before = self.seen_by.get(&report.camera);
            let since_s = before.map_or(f64::INFINITY, |before| report.at_s - before);
            self.posture.add(&person.signs, report.camera_m, since_s);
        }
        self.seen_s = self.seen_s.max(report.at_s);
        self.last_person = report.person(seen);
        self.foot_px = person.foot_px;
        self.center_px = person.center_px;
        self.length_px = person.size_px[0].max(person.size_px[1]);
        self.in_margin = person.is_in_margin;
        self.seen_by.insert(report.camera, report.at_s);
        if self.tail.len() == MAX_TAIL_POINTS {
            self.tail.pop_front();
        }
        self.tail.push_back(TailPoint {
            at_s: self.seen_s,
            floor_m: self.place(Plane::FloorM),
            foot_px: self.foot_px,
        });
    }

    /// Returns true once the track has enough evidence of a person.
    pub fn is_confirmed(&self) -> bool {
        self.confirmed
    }

    /// Returns true once the track has left its first place.
    pub fn has_moved(&self) -> bool {
        self.has_moved
    }

    /// Returns true if a confirmed track has been at its first place since it began, for a while.
    pub(super) fn stands(&self) -> bool {
        let seen_s = self.seen_s - self.first_seen_s;
        self.confirmed && !self.has_moved && !self.in_margin && seen_s >= START_AFTER_S
    }

    /// Returns true if the track counts: it is confirmed, and its last person was not in the margin
    /// of an area.
    pub fn counts(&self) -> bool {
        self.confirmed && !self.in_margin
    }

    /// Returns the place at the last observation: filtered on the floor, as observed in the frame.
    /// `None` for the floor without the camera's height.
    pub fn place(&self, plane: Plane) -> Option<[f64; 2]> {
        match plane {
            Plane::FloorM => self.motion.on_floor().map(|state| state.place().into()),
            Plane::FramePx => Some(self.foot_px),
        }
    }

    /// Returns the posture at the last observation, with its probability: the boxes before tell the
    /// size of the person.
    pub fn posture(&self) -> (Posture, f64) {
        self.posture.posture()
    }

    /// Returns the evidence about the posture up to the last observation.
    pub fn posture_belief(&self) -> &PostureBelief {
        &self.posture
    }

    /// Returns the velocity on the floor, meters per second; `None` without the camera's height.
    pub fn velocity_m_s(&self) -> Option<[f64; 2]> {
        self.motion.on_floor().map(|state| state.velocity().into())
    }

    /// Returns the last places, oldest first, at most [`MAX_TAIL_POINTS`].
    pub fn tail(&self) -> impl ExactSizeIterator<Item = &TailPoint> {
        self.tail.iter()
    }
}

/// Identifies a track within its tracker, and a later one of the same person who came back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TrackId(pub u64);

//! The tracker: association of each report's persons with the tracks.

use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};

use super::{
    Track, TrackId, TrackerSettings,
    assignment::best_pairs,
    camera::Camera,
    duplicates::end_duplicates,
    measurement::Measurement,
    track::{PersonOfReport, Sighting},
};
use crate::{CameraPose, Observation};

/// Most cameras of a tracker.
pub const MAX_CAMERAS: usize = 64;
/// Most persons of a report that are considered: those with the highest scores.
pub const MAX_PERSONS: usize = 300;
/// Squared Mahalanobis distance beyond which a person never continues a track: the 99.9 % quantile
/// of the chi-squared distribution with two degrees of freedom.
const GATE: f64 = 13.8;
/// Reports without its person after which a track that is not confirmed ends.
const MAX_MISSED_UNCONFIRMED: u32 = 2;

/// A tracker of one camera or one site. Serializable: stored with the counts, it survives a restart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tracker {
    settings: TrackerSettings,
    cameras: Vec<Camera>,
    on_floor: bool,
    tracks: Vec<Track>,
    next_id: u64,
    newest_report_s: f64,
}

/// Cameras that make no tracker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SiteError {
    /// Too few or too many cameras.
    #[error("a site has {0} cameras: give 1 to {MAX_CAMERAS}")]
    Count(usize),
    /// A camera of several without its height.
    #[error(
        "camera number {0} of the site has no height: set mount.height_m, which places persons on the common floor"
    )]
    NoHeight(usize),
}

/// A report that cannot update the tracks.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RefusedReport {
    /// A camera that is not in the tracker.
    #[error("camera number {0} is not part of the tracker")]
    UnknownCamera(usize),
    /// A time that is not finite.
    #[error("the time of the report is not finite")]
    Time,
    /// A report that is not newer than the camera's last one.
    #[error("the report is not newer than the last one of its camera")]
    OutOfOrder,
    /// A report that came too long after those of other cameras.
    #[error("the report is {0:.1} s older than the newest one of the site")]
    Late(f64),
}

/// A person of the current report with its measurement.
struct Candidate<'a> {
    index: usize,
    person: &'a Observation,
    measured: Measurement,
}

impl Tracker {
    /// Returns a tracker for `cameras`: on the floor where every camera has its height, else in
    /// bearing space.
    ///
    /// # Errors
    /// [`SiteError`] without cameras, with more than [`MAX_CAMERAS`], or with several of which one
    /// lacks its height.
    pub fn new(poses: &[CameraPose], settings: TrackerSettings) -> Result<Self, SiteError> {
        if !(1..=MAX_CAMERAS).contains(&poses.len()) {
            return Err(SiteError::Count(poses.len()));
        }
        let without_height = poses.iter().position(|pose| pose.height_m.is_none());
        if let (Some(number), true) = (without_height, poses.len() > 1) {
            return Err(SiteError::NoHeight(number));
        }
        let camera = |&pose| Camera {
            pose,
            last_report_s: None,
        };
        Ok(Self {
            settings,
            cameras: poses.iter().map(camera).collect(),
            on_floor: without_height.is_none(),
            tracks: Vec::new(),
            next_id: 1,
            newest_report_s: f64::NEG_INFINITY,
        })
    }

    /// Updates the tracks with the persons of one frame of the camera number `camera`, captured at
    /// `at_s` (seconds since the Unix epoch). Returns the confirmed tracks that ended.
    ///
    /// Reports of several cameras may arrive in any order within
    /// [`TrackerSettings::max_lateness_s`]; those of one camera are in order of time.
    ///
    /// # Errors
    /// [`RefusedReport`] for an unknown camera, a time that is not finite, or a report that is too
    /// old. Nothing changes then.
    pub fn update(
        &mut self,
        camera: usize,
        at_s: f64,
        persons: &[Observation],
    ) -> Result<Vec<Track>, RefusedReport> {
        self.check(camera, at_s)?;
        let candidates = self.candidates(camera, persons);
        let updated = self.associate(camera, at_s, &candidates);
        self.start_tracks(camera, at_s, &candidates, &updated);
        self.count_misses(camera, at_s);
        self.cameras[camera].last_report_s = Some(at_s);
        self.newest_report_s = self.newest_report_s.max(at_s);
        let mut ended = self.end_unseen();
        if self.cameras.len() > 1 {
            ended.extend(end_duplicates(&mut self.tracks, self.newest_report_s));
        }
        ended.retain(Track::is_confirmed);
        Ok(ended)
    }

    /// Returns the confirmed tracks in order of their identifiers; those without a person in the
    /// last report are among them until they end.
    pub fn tracks(&self) -> impl Iterator<Item = &Track> {
        self.tracks.iter().filter(|track| track.is_confirmed())
    }

    fn check(&self, camera: usize, at_s: f64) -> Result<(), RefusedReport> {
        let known = self.cameras.get(camera);
        let known = known.ok_or(RefusedReport::UnknownCamera(camera))?;
        if !at_s.is_finite() {
            return Err(RefusedReport::Time);
        }
        if known.last_report_s.is_some_and(|last| at_s <= last) {
            return Err(RefusedReport::OutOfOrder);
        }
        let lateness = self.newest_report_s - at_s;
        if lateness > self.settings.max_lateness_s {
            return Err(RefusedReport::Late(lateness));
        }
        Ok(())
    }

    /// The persons that count, in an order that does not depend on the report's.
    fn candidates<'a>(&self, camera: usize, persons: &'a [Observation]) -> Vec<Candidate<'a>> {
        let pose = &self.cameras[camera].pose;
        let noise = &self.settings.noise;
        let measure = |person| match pose.height_m {
            Some(height_m) if self.on_floor => Measurement::on_floor(person, pose, height_m, noise),
            _ => Measurement::of_bearing(person, noise),
        };
        let mut candidates: Vec<_> = persons
            .iter()
            .enumerate()
            .filter(|(_, person)| person.score >= self.settings.low_score)
            .filter_map(|(index, person)| {
                let measured = measure(person)?;
                Some(Candidate {
                    index,
                    person,
                    measured,
                })
            })
            .collect();
        let key = |candidate: &Candidate| {
            let person = candidate.person;
            let [foot_x, foot_y] = person.foot_px;
            [
                -person.score,
                foot_x,
                foot_y,
                person.off_axis_deg,
                person.azimuth_deg,
            ]
        };
        candidates.sort_by(|a, b| {
            let pairs = key(a).into_iter().zip(key(b));
            pairs.fold(std::cmp::Ordering::Equal, |order, (a, b)| {
                order.then(a.total_cmp(&b))
            })
        });
        candidates.truncate(MAX_PERSONS);
        candidates
    }

    /// Continues tracks with persons; returns true for each candidate that continued one.
    fn associate(&mut self, camera: usize, at_s: f64, candidates: &[Candidate]) -> Vec<bool> {
        let high = self.settings.high_score;
        let mut used = vec![false; candidates.len()];
        let mut continued = vec![false; self.tracks.len()];
        // ByteTrack's three steps: high scores, low scores, then tracks without confirmation.
        let steps: [(bool, fn(f64, f64) -> bool); 3] = [
            (true, |score, high| score >= high),
            (true, |score, high| score < high),
            (false, |_, _| true),
        ];
        for (confirmed, admits) in steps {
            let rows: Vec<usize> = (0..self.tracks.len())
                .filter(|&row| !continued[row] && self.tracks[row].is_confirmed() == confirmed)
                .collect();
            let columns: Vec<usize> = (0..candidates.len())
                .filter(|&column| !used[column] && admits(candidates[column].measured.score, high))
                .collect();
            let pairs = best_pairs(rows.len(), columns.len(), |row, column| {
                let track = &self.tracks[rows[row]];
                self.gain(track, &candidates[columns[column]].measured, at_s)
            });
            for (row, column) in pairs {
                let (row, column) = (rows[row], columns[column]);
                let seen = sighting(camera, at_s, &candidates[column]);
                self.tracks[row].update(&seen, &self.settings);
                continued[row] = true;
                used[column] = true;
            }
        }
        used
    }

    /// The logarithm of the likelihood ratio of "this person continues this track" to "this person
    /// is new or false" (Blackman and Popoli, "Design and Analysis of Modern Tracking Systems"
    /// (1999), section 6.2); negative beyond the gate.
    fn gain(&self, track: &Track, measured: &Measurement, at_s: f64) -> f64 {
        let plane = self.settings.plane_of(&measured.place);
        let innovation = track.motion.innovation(measured, at_s, plane);
        if innovation.squared_distance() > GATE {
            return -1.0;
        }
        innovation.log_density() - plane.clutter_density.ln()
    }

    fn start_tracks(&mut self, camera: usize, at_s: f64, candidates: &[Candidate], used: &[bool]) {
        for (candidate, _) in candidates.iter().zip(used).filter(|(_, used)| !**used) {
            let is_strong = candidate.measured.score >= self.settings.new_track_score;
            let has_room = self.tracks.len() < self.settings.max_tracks;
            if is_strong && has_room && !self.is_taken(camera, at_s, &candidate.measured) {
                let seen = sighting(camera, at_s, candidate);
                let id = TrackId(self.next_id);
                self.next_id += 1;
                self.tracks.push(Track::new(id, &seen, &self.settings));
            }
        }
    }

    /// Returns true when a track that this report continued or started is too near for another.
    fn is_taken(&self, camera: usize, at_s: f64, measured: &Measurement) -> bool {
        let plane = self.settings.plane_of(&measured.place);
        let exact = Measurement {
            noise: Matrix2::zeros(),
            ..*measured
        };
        self.tracks.iter().any(|track| {
            let is_current = track.seen_by.get(&camera) == Some(&at_s);
            let distance = track.motion.innovation(&exact, at_s, plane).residual.norm();
            is_current && distance < plane.least_distance
        })
    }

    fn count_misses(&mut self, camera: usize, at_s: f64) {
        let is_alone = self.cameras.len() == 1;
        let known = &self.cameras[camera];
        for track in &mut self.tracks {
            let is_seen = track.seen_by.get(&camera) == Some(&at_s);
            if !is_seen
                && (is_alone
                    || track
                        .motion
                        .floor_at(at_s)
                        .is_some_and(|place| known.sees(place)))
            {
                track.missed = track.missed.saturating_add(1);
            }
        }
    }

    fn end_unseen(&mut self) -> Vec<Track> {
        let (settings, now) = (&self.settings, self.newest_report_s);
        let is_over = |track: &mut Track| {
            let unseen_s = now - track.seen_s();
            let is_missed = if track.is_confirmed() {
                track.missed >= settings.max_missed && unseen_s > settings.max_unseen_s
            } else {
                track.missed >= MAX_MISSED_UNCONFIRMED
            };
            is_missed || unseen_s > settings.max_silent_s
        };
        self.tracks.extract_if(.., is_over).collect()
    }
}

fn sighting<'a>(camera: usize, at_s: f64, candidate: &'a Candidate) -> Sighting<'a> {
    Sighting {
        at_s,
        source: PersonOfReport {
            camera,
            person: candidate.index,
        },
        person: candidate.person,
        measured: &candidate.measured,
    }
}

//! The tracker: association of each report's persons with the tracks.

use std::collections::BTreeSet;

use lookdown_lens::geometry::Polygon;
use pathfinding::{kuhn_munkres::kuhn_munkres, matrix::Matrix};
use serde::{Deserialize, Serialize};

use crate::{
    CameraPose, Observation, Track, TrackId, TrackerSettings,
    camera::Camera,
    candidates::{Candidate, Separated, candidates, separate},
    evidence::log_odds,
    furniture::Furniture,
    kalman::Innovation,
    measurement::Measurement,
    reappearance::{continue_lost, keep_lost},
    track::CurrentReport,
};

/// Most cameras of a tracker.
pub const MAX_CAMERAS: usize = 64;
/// Squared Mahalanobis distance beyond which a person never continues a track: the 99.9 % quantile
/// of the chi-squared distribution with two degrees of freedom.
const GATE: f64 = 13.8;

/// A tracker of one camera or one site. Serializable: stored with the counts, it survives a
/// restart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tracker {
    settings: TrackerSettings,
    cameras: Vec<Camera>,
    on_floor: bool,
    tracks: Vec<Track>,
    /// Confirmed tracks that ended, whose persons may come back.
    #[serde(default)]
    lost: Vec<Track>,
    next_id: u64,
    newest_report_s: Option<f64>,
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
            furniture: Furniture::default(),
            areas: Vec::new(),
        };
        Ok(Self {
            settings,
            cameras: poses.iter().map(camera).collect(),
            on_floor: without_height.is_none(),
            tracks: Vec::new(),
            lost: Vec::new(),
            next_id: 1,
            newest_report_s: None,
        })
    }

    /// Limits the reports of a camera to areas on the floor of the site: it misses no person
    /// elsewhere. Not stored.
    pub fn limit(&mut self, camera: usize, areas: Vec<Polygon>) {
        if let Some(camera) = self.cameras.get_mut(camera) {
            camera.areas = areas;
        }
    }

    /// Returns the things that stand in the frame of a camera.
    pub fn furniture(&self, camera: usize) -> Option<&Furniture> {
        Some(&self.cameras.get(camera)?.furniture)
    }

    /// Returns the same to change it, or to restore that of another tracker.
    pub fn furniture_mut(&mut self, camera: usize) -> Option<&mut Furniture> {
        Some(&mut self.cameras.get_mut(camera)?.furniture)
    }

    /// Updates the tracks with the persons of one frame of the camera number `camera`, captured at
    /// `at_s` (seconds since the Unix epoch). Returns the confirmed tracks that ended.
    ///
    /// `elapsed_s` is the time since the camera's last report by a clock that never jumps:
    /// furniture is observed no longer than that.
    ///
    /// Reports of several cameras may arrive in any order within
    /// [`TrackerSettings::max_lateness_s`]; those of one camera are in order of time.
    ///
    /// # Errors
    /// [`RefusedReport`] for an unknown camera, a time that is not finite, or a report that is too
    /// old. Nothing changes then.
    pub fn update(
        &mut self,
        elapsed_s: f64,
        camera: usize,
        at_s: f64,
        persons: &[Observation],
    ) -> Result<Vec<Track>, RefusedReport> {
        self.check(camera, at_s)?;
        let Camera {
            pose,
            last_report_s,
            ..
        } = &self.cameras[camera];
        let candidates = candidates(persons, (camera, pose, self.on_floor), &self.settings);
        let report = CurrentReport {
            camera,
            at_s,
            interval_s: last_report_s.map_or(f64::INFINITY, |last| at_s - last),
            unwatched_s: at_s - self.newest_report_s.unwrap_or(at_s),
            camera_m: pose.height_m,
        };
        let observed_s = report.interval_s.min(elapsed_s);
        let seen: Vec<&Observation> = candidates.iter().map(|one| one.person).collect();
        let shown = self.cameras[camera].furniture.update(&seen, observed_s);
        let Separated {
            candidates,
            furniture,
            unknown,
        } = separate(candidates, &shown);
        let possible = self.tracks.iter().filter(|track| !track.is_confirmed());
        let mut possible: Vec<TrackId> = possible.map(|track| track.id).collect();
        let first_new = self.next_id;
        let used = self.associate(&report, &candidates);
        self.start_tracks(&report, (&candidates, &furniture), &used);
        possible.extend((first_new..self.next_id).map(TrackId));
        for id in possible {
            continue_lost(&mut self.tracks, &mut self.lost, id, &self.settings);
        }
        self.start_things(&report, persons, &unknown);
        self.count_misses(&report);
        self.cameras[camera].last_report_s = Some(at_s);
        let now_s = self.newest_report_s.map_or(at_s, |newest| newest.max(at_s));
        self.newest_report_s = Some(now_s);
        let mut ended = self.end_unseen(now_s);
        keep_lost(&mut self.lost, &ended, now_s, self.settings.max_absent_s);
        if self.cameras.len() > 1 {
            ended.extend(end_duplicates(&mut self.tracks, now_s));
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
        let lateness = self.newest_report_s.map_or(0.0, |newest| newest - at_s);
        if lateness > self.settings.max_lateness_s {
            return Err(RefusedReport::Late(lateness));
        }
        Ok(())
    }

    /// Continues tracks with persons in the three steps of `ByteTrack`: high scores, low scores,
    /// then tracks without confirmation. Returns true for each candidate that continued a track.
    fn associate(&mut self, report: &CurrentReport, candidates: &[Candidate]) -> Vec<bool> {
        let high = self.settings.high_score;
        let mut used = vec![false; candidates.len()];
        for (confirmed, scores) in [
            (true, high..=f64::INFINITY),
            (true, f64::NEG_INFINITY..=high),
            (false, f64::NEG_INFINITY..=f64::INFINITY),
        ] {
            let rows: Vec<usize> = (0..self.tracks.len())
                .filter(|&row| {
                    let track = &self.tracks[row];
                    track.is_confirmed() == confirmed && !report.shows(track)
                })
                .collect();
            let columns: Vec<usize> = (0..candidates.len())
                .filter(|&column| {
                    !used[column] && scores.contains(&candidates[column].measured.score)
                })
                .collect();
            let plane = if self.on_floor {
                &self.settings.floor
            } else {
                &self.settings.bearing
            };
            let motions = rows.iter().map(|&row| &self.tracks[row].motion);
            let filters: Vec<_> = motions
                .map(|motion| motion.filter_at(report.at_s, plane))
                .collect();
            let pairs = best_pairs(rows.len(), columns.len(), |row, column| {
                let measured = &candidates[columns[column]].measured;
                let track = &self.tracks[rows[row]];
                let innovation = track.motion.innovation(&filters[row], measured);
                self.gain(track, &innovation, measured)
            });
            for (row, column) in pairs {
                let seen = &candidates[columns[column]];
                self.tracks[rows[row]].update(report, seen, &self.settings);
                used[columns[column]] = true;
            }
        }
        used
    }

    /// The logarithm of the likelihood ratio of "this person continues this track" to "this person
    /// is new or false" (Blackman and Popoli, "Design and Analysis of Modern Tracking Systems"
    /// (1999), section 6.2); negative beyond the gate.
    fn gain(&self, track: &Track, innovation: &Innovation, measured: &Measurement) -> f64 {
        let plane = self.settings.plane_of(&measured.place);
        if innovation.squared_distance() > GATE {
            return -1.0;
        }
        let is_person = self.settings.score_share * log_odds(measured.score);
        let is_there = track.evidence.log_probability(&self.settings.evidence);
        innovation.log_density() - plane.clutter_density.ln() + is_person + is_there
    }

    /// Starts things where confirmed tracks have stood for a while.
    fn start_things(
        &mut self,
        report: &CurrentReport,
        persons: &[Observation],
        unknown: &BTreeSet<usize>,
    ) {
        let tracks = self.tracks.iter();
        let standing = tracks.filter(|track| report.shows(track) && track.stands());
        let indices = standing.map(|track| track.last_person.person);
        let furniture = &mut self.cameras[report.camera].furniture;
        for index in indices.filter(|index| unknown.contains(index)) {
            furniture.start(&persons[index]);
        }
    }

    fn start_tracks(
        &mut self,
        report: &CurrentReport,
        (candidates, furniture): (&[Candidate], &[Measurement]),
        used: &[bool],
    ) {
        for (candidate, _) in candidates.iter().zip(used).filter(|(_, used)| !**used) {
            let measured = &candidate.measured;
            let is_part = furniture.iter().any(|thing| measured.is_part_of(thing));
            let least = if is_part || self.is_taken(report, measured) {
                self.settings.new_track_score_in_line
            } else {
                self.settings.new_track_score
            };
            if candidate.measured.score >= least && self.tracks.len() < self.settings.max_tracks {
                let id = TrackId(self.next_id);
                self.next_id += 1;
                let track = Track::new(id, report, candidate, &self.settings);
                self.tracks.push(track);
            }
        }
    }

    /// Returns true when this may be a further box of a person that the report holds already.
    fn is_taken(&self, report: &CurrentReport, measured: &Measurement) -> bool {
        let current = self.tracks.iter().filter(|track| report.shows(track));
        let mut motions = current.map(|track| &track.motion);
        motions.any(|motion| motion.is_same_person(measured, report.at_s))
    }

    fn count_misses(&mut self, report: &CurrentReport) {
        let is_alone = self.cameras.len() == 1;
        let camera = &self.cameras[report.camera];
        for track in self.tracks.iter_mut().filter(|track| !report.shows(track)) {
            let expected = track.motion.floor_at(report.at_s);
            if is_alone || expected.is_some_and(|place| camera.sees(place)) {
                track.missed = track.missed.saturating_add(1);
                let evidence = &self.settings.evidence;
                track.evidence.add_miss(report.interval_s, evidence);
            }
        }
    }

    fn end_unseen(&mut self, now_s: f64) -> Vec<Track> {
        let settings = &self.settings;
        let is_over = |track: &mut Track| {
            let unseen_s = now_s - track.seen_s;
            let is_missed = track.missed >= settings.max_missed && unseen_s > settings.max_unseen_s;
            let is_refuted = !track.is_confirmed()
                && track.missed > 0
                && track.evidence.refutes(&settings.evidence);
            let is_revoked = track.is_confirmed() && track.evidence.revokes(&settings.evidence);
            is_missed || is_refuted || is_revoked || unseen_s > settings.max_silent_s
        };
        self.tracks.extract_if(.., is_over).collect()
    }
}

/// Integer steps of a gain of 1: the algorithm compares exactly.
const GAIN_STEPS: f64 = 1e6;
/// Gains beyond this are alike.
const MAX_GAIN: f64 = 1e6;

/// Returns the pairs (row, column) with the greatest sum of gains. A pair whose gain is not above 0
/// is never made; rows and columns may stay alone.
#[allow(
    clippy::cast_possible_truncation,
    reason = "the gain is limited to a range that i64 holds"
)]
pub(super) fn best_pairs(
    rows: usize,
    columns: usize,
    gain: impl Fn(usize, usize) -> f64,
) -> Vec<(usize, usize)> {
    if rows == 0 || columns == 0 {
        return Vec::new();
    }
    // The algorithm wants no more rows than columns.
    let swap = rows > columns;
    let (short, long) = if swap {
        (columns, rows)
    } else {
        (rows, columns)
    };
    let ordered = |(a, b): (usize, usize)| if swap { (b, a) } else { (a, b) };
    let weights = Matrix::from_fn(short, long, |cell| {
        let (row, column) = ordered(cell);
        // A gain that is not a number is none: the conversion makes it 0.
        (gain(row, column).clamp(0.0, MAX_GAIN) * GAIN_STEPS).round() as i64
    });
    let (_, matched) = kuhn_munkres(&weights);
    let cells = matched.into_iter().enumerate();
    cells
        .filter(|&cell| weights[cell] > 0)
        .map(ordered)
        .collect()
}

/// Tracks nearer than this may be one person, meters.
const MERGE_DISTANCE_M: f64 = 0.8;
/// Squared Mahalanobis distance up to which they may be: the 99 % quantile of the chi-squared
/// distribution with two degrees of freedom.
const MERGE_GATE: f64 = 9.21;
/// A camera that saw both within this time holds them apart, seconds.
const SEPARATE_S: f64 = 3.0;

/// Removes and returns the younger one of each two tracks that no camera saw as two persons.
pub(super) fn end_duplicates(tracks: &mut Vec<Track>, now_s: f64) -> Vec<Track> {
    let mut ended = Vec::new();
    let mut younger = 0;
    while younger < tracks.len() {
        let is_duplicate = tracks[..younger]
            .iter()
            .any(|older| are_one_person(older, &tracks[younger], now_s));
        if is_duplicate {
            ended.push(tracks.remove(younger));
        } else {
            younger += 1;
        }
    }
    ended
}

fn are_one_person(a: &Track, b: &Track, now_s: f64) -> bool {
    let recently = |track: &Track, camera: &usize| {
        let seen = track.seen_by.get(camera);
        seen.is_some_and(|&at_s| now_s - at_s <= SEPARATE_S)
    };
    if a.seen_by
        .keys()
        .any(|camera| recently(a, camera) && recently(b, camera))
    {
        return false;
    }
    let at_s = a.motion.at_s.max(b.motion.at_s);
    a.motion.separation(&b.motion, at_s).is_some_and(|between| {
        between.residual.norm() < MERGE_DISTANCE_M && between.squared_distance() < MERGE_GATE
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn sum(gains: &[Vec<f64>], pairs: &[(usize, usize)]) -> f64 {
        pairs.iter().map(|&(row, column)| gains[row][column]).sum()
    }

    /// The greatest sum of gains by trying every assignment of the rows from `row` on.
    fn greatest(gains: &[Vec<f64>], row: usize, taken: &mut Vec<usize>) -> f64 {
        let Some(columns) = gains.get(row) else {
            return 0.0;
        };
        let mut best = greatest(gains, row + 1, taken);
        for (column, gain) in columns.iter().enumerate() {
            if *gain > 0.0 && !taken.contains(&column) {
                taken.push(column);
                best = best.max(gain + greatest(gains, row + 1, taken));
                taken.pop();
            }
        }
        best
    }

    #[test]
    fn nothing_is_paired_without_a_gain() {
        assert_eq!(best_pairs(2, 3, |_, _| -1.0), []);
        assert_eq!(best_pairs(2, 3, |_, _| f64::NAN), []);
        assert_eq!(best_pairs(0, 3, |_, _| 1.0), []);
        assert_eq!(best_pairs(3, 0, |_, _| 1.0), []);
    }

    proptest! {
        #[test]
        fn pairs_have_the_greatest_sum_of_gains(
            (rows, columns, gains) in (1..5_usize, 1..5_usize).prop_flat_map(|(rows, columns)| {
                let row = prop::collection::vec(-5.0..10.0_f64, columns);
                (Just(rows), Just(columns), prop::collection::vec(row, rows))
            }),
        ) {
            let pairs = best_pairs(rows, columns, |row, column| gains[row][column]);
            let best = greatest(&gains, 0, &mut Vec::new());
            prop_assert!((sum(&gains, &pairs) - best).abs() < 1e-4);
            prop_assert!(pairs.iter().all(|&(row, column)| gains[row][column] > 0.0));
        }
    }
}

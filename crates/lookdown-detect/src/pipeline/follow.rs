//! Follows the persons of a camera between searches of the whole frame.
//!
//! After a search, the cells of the next frames are compared with those of the searched frame.
//! [`FollowedPeople`] tells from the cells with motion whom a crop must confirm, and when another
//! search is needed.

use std::{
    sync::{Arc, Weak},
    time::{Duration, Instant},
};

use jiff::Timestamp;
use lookdown_lens::geometry::{
    OrientedBox, crop_placement::CropTarget, hull::middle, oriented_box::vertical_in_frame,
};
use lookdown_tracking::{
    follow::{FollowedPeople, FoundPerson, JOINED_CELLS, LEAST_FILL, SEARCH_EVERY_S},
    taught,
};
use parking_lot::Mutex;

use super::{
    Person, camera_cache::CameraCache, camera_rig::CameraRig, merge, motion_cache::MAX_AGE,
};
use crate::{detection::RefinementParameters, inference::Model};
use lookdown_imaging::{Frame, FrameSignature, MovedCell, NEW_LEVELS, is_noise};

/// Most persons in motion that are followed. With more, every frame is searched.
const MAX_MOVING: usize = 32;
/// If more than one of this many cells has moved, the light has changed: the frame is searched.
const MOST_MOVED: usize = 4;
/// Least score of boxes of crops, before they get the odds of their persons.
const LEAST_SCORE: f64 = 1e-4;
/// The next search of a camera is not due before so many times the time that the last one took.
/// Searches of frames that wait for others would otherwise leave no time to follow anyone.
const SEARCH_TIMES: u32 = 3;
/// … but it is due after this time, in which most walkers leave the widest crops.
const MAX_SEARCH_EVERY: Duration = Duration::from_secs(2);

/// The followed persons of each camera.
#[derive(Default)]
pub(super) struct FollowCache(CameraCache<Mutex<Option<Followed>>>);

impl FollowCache {
    /// Compares a frame of a camera, captured at `at`, with those before. While one frame is
    /// processed, another one of the same camera is searched.
    pub(super) fn compare(
        &self,
        camera: &str,
        origin: FollowOrigin,
        frame: &Frame,
        at: Timestamp,
    ) -> FollowedFrame {
        let kept = self.0.get_or_renew(camera, Mutex::default, |_| false);
        let before = kept.lock().take();
        let before = before.filter(|before| before.origin.is_same(&origin));
        let signature = FrameSignature::new(frame);
        let moving = before.as_ref();
        let moving = moving.and_then(|before| before.moving(&signature, at));
        let is_unsure = |before: &Followed| moving.is_none() && before.is_unsure(&signature);
        FollowedFrame {
            repeats_search: before.as_ref().is_some_and(is_unsure),
            kept,
            origin,
            signature,
            started: Instant::now(),
            at,
            before,
            moving,
            is_confirmed: false,
        }
    }
}

/// The circumstances under which persons may be followed from one frame to the next.
pub(super) struct FollowOrigin {
    // Weak: an inactive camera must not keep tables or weights in memory.
    rig: Weak<CameraRig>,
    model: Weak<Model>,
    refinement: RefinementParameters,
    skips_still_frames: bool,
}

impl FollowOrigin {
    /// With `skips_still_frames`, a frame without any motion since the search is not searched while
    /// the motion cache would keep its views.
    pub(super) fn new(
        rig: &Arc<CameraRig>,
        model: &Arc<Model>,
        refinement: RefinementParameters,
        skips_still_frames: bool,
    ) -> Self {
        Self {
            rig: Arc::downgrade(rig),
            model: Arc::downgrade(model),
            refinement,
            skips_still_frames,
        }
    }

    fn is_same(&self, other: &Self) -> bool {
        self.rig.ptr_eq(&other.rig)
            && self.model.ptr_eq(&other.model)
            && self.refinement == other.refinement
            && self.skips_still_frames == other.skips_still_frames
    }
}

/// The persons of a camera since the last search.
struct Followed {
    origin: FollowOrigin,
    searched_at: Timestamp,
    /// Time from this search to the next one.
    search_every: Duration,
    at: Timestamp,
    /// The signature of the searched frame.
    searched: FrameSignature,
    /// The cells of a frame that can show a person.
    visible: Arc<[bool]>,
    people: FollowedPeople<Person>,
    /// The boxes of the search below the threshold.
    candidates: Vec<Person>,
}

impl Followed {
    /// Returns which persons have motion around them. `None` if the whole frame must be searched.
    fn moving(&self, signature: &FrameSignature, at: Timestamp) -> Option<Vec<bool>> {
        // An error: a frame older than the searched one.
        let age = Duration::try_from(at.duration_since(self.searched_at)).ok()?;
        if at < self.at || age >= MAX_AGE {
            return None;
        }
        let moved = signature.moved_since(&self.searched, &self.visible)?;
        let moved = if is_noise(&moved) { Vec::new() } else { moved };
        let is_still = moved.is_empty() && self.people.are_settled();
        if age >= self.search_every && !(is_still && self.origin.skips_still_frames) {
            return None;
        }
        if moved.len() > self.visible.len() / MOST_MOVED || !self.explains(&moved, at) {
            return None;
        }
        let moved: Vec<_> = moved.iter().map(|cell| cell.bounds).collect();
        let moving = self.people.moving(&moved, seconds(at));
        let count = moving.iter().filter(|is_moving| **is_moving).count();
        let fill = self.people.most_fill(&moving, seconds(at));
        (count <= MAX_MOVING && fill >= LEAST_FILL).then_some(moving)
    }

    /// Returns true if nothing has moved since a search that has left someone unsure: the next one
    /// must not find its views in the motion cache.
    fn is_unsure(&self, signature: &FrameSignature) -> bool {
        let moved = || signature.moved_since(&self.searched, &self.visible);
        !self.people.are_settled() && moved().is_some_and(|moved| is_noise(&moved))
    }

    /// Returns true if all strong motion is joined to a person, as a shadow is.
    fn explains(&self, moved: &[MovedCell], at: Timestamp) -> bool {
        let bounds: Vec<_> = moved.iter().map(|cell| cell.bounds).collect();
        let cell_px = bounds.first().map_or(0.0, |bounds| bounds[2] - bounds[0]);
        let reach_px = JOINED_CELLS * cell_px;
        let others = self.people.unexplained(&bounds, reach_px, seconds(at));
        others.iter().all(|&other| moved[other].levels < NEW_LEVELS)
    }

    /// Confirms persons in motion by those found in crops. Others that were found become persons of
    /// their own if their score suffices.
    fn confirm(&mut self, moving: &[bool], found: Vec<Person>, at: Timestamp, rig: &CameraRig) {
        self.at = at;
        let least_score = self.origin.refinement.score_threshold;
        let place = |found: &Person, score, upright_box| {
            let votes = found.floor_votes;
            merge::placed(found.bbox, score, upright_box, found.views, votes, rig)
        };
        self.people
            .confirm(moving, found, seconds(at), least_score, place);
    }

    /// Returns the persons that are seen, highest score first.
    fn persons(&self, refinement: &RefinementParameters) -> Vec<Person> {
        let seen = self.people.seen();
        let seen = seen.filter(|person| person.score >= refinement.score_threshold);
        let mut persons: Vec<_> = seen.cloned().collect();
        persons.sort_by(|a, b| b.score.total_cmp(&a.score));
        persons.truncate(refinement.max_detections);
        persons
    }
}

/// A frame of a camera whose persons are followed.
pub(super) struct FollowedFrame {
    kept: Arc<Mutex<Option<Followed>>>,
    origin: FollowOrigin,
    signature: FrameSignature,
    started: Instant,
    at: Timestamp,
    before: Option<Followed>,
    /// The persons of `before` with motion; `None` if the whole frame is searched.
    moving: Option<Vec<bool>>,
    /// True if the frame is searched because the search before it has left someone unsure.
    pub(super) repeats_search: bool,
    /// True once the crops of the frame have confirmed the persons of `before`.
    is_confirmed: bool,
}

impl FollowedFrame {
    /// Returns the places of the crops, best persons first, and the share of their sides that
    /// people may fill at most; `None` if the whole frame is searched.
    pub(super) fn targets(&self, rig: &CameraRig) -> Option<(Vec<CropTarget>, f64)> {
        let (before, moving) = (self.before.as_ref()?, self.moving.as_ref()?);
        let geometry = &rig.geometry;
        let expected = before.people.expected(moving, seconds(self.at));
        let mut targets: Vec<_> = expected
            .map(|(person, bbox)| CropTarget {
                bbox,
                score: person.score,
                up: vertical_in_frame(middle(bbox), &geometry.lens, &geometry.mount),
            })
            .collect();
        targets.sort_by(|a, b| b.score.total_cmp(&a.score));
        Some((targets, before.people.most_fill(moving, seconds(self.at))))
    }

    /// Confirms the persons in motion by those in the crops of the frame, which `found_by` returns.
    /// Returns false if someone is lost: then the whole frame must be searched.
    pub(super) fn confirm(
        &mut self,
        rig: &CameraRig,
        found_by: impl Fn(&RefinementParameters) -> Vec<Person>,
    ) -> bool {
        let (Some(before), Some(moving)) = (self.before.as_mut(), self.moving.take()) else {
            return false;
        };
        let refinement = self.origin.refinement;
        let found = found_by(&RefinementParameters {
            score_threshold: refinement.score_threshold.min(LEAST_SCORE),
            ..refinement
        });
        let people = before.people.clone();
        before.confirm(&moving, found, self.at, rig);
        if people.are_lost_in(&before.people, refinement.score_threshold) {
            before.people = people;
            return false;
        }
        self.is_confirmed = true;
        true
    }

    /// Returns the persons of the frame and the boxes below the threshold, highest score first, and
    /// keeps them for the next frame. `found_by` returns the persons in the views of a search.
    pub(super) fn persons(
        self,
        rig: &CameraRig,
        found_by: impl Fn(&RefinementParameters) -> Vec<Person>,
    ) -> Vec<Person> {
        let refinement = self.origin.refinement;
        let (mut persons, state) = match self.before {
            Some(state) if self.is_confirmed => (state.persons(&refinement), state),
            before => {
                let mut persons = found_by(&with_candidates(&refinement));
                let is_person = |person: &Person| person.score >= refinement.score_threshold;
                let candidates = persons.split_off(persons.partition_point(is_person));
                let visible = before.as_ref().map(|before| Arc::clone(&before.visible));
                let visible = visible.unwrap_or_else(|| visible_cells(&self.signature, rig));
                let before = before.map(|before| before.people);
                let state = Followed {
                    origin: self.origin,
                    searched_at: self.at,
                    search_every: search_every(self.started.elapsed()),
                    at: self.at,
                    searched: self.signature,
                    visible,
                    people: FollowedPeople::from_search(
                        &persons,
                        seconds(self.at),
                        before.as_ref(),
                    ),
                    candidates,
                };
                (persons, state)
            }
        };
        persons.extend_from_slice(&state.candidates);
        *self.kept.lock() = Some(state);
        persons
    }
}

impl FoundPerson for Person {
    fn bounds(&self) -> [f64; 4] {
        self.bbox.corners()
    }

    fn upright_box(&self) -> OrientedBox {
        self.upright_box
    }

    fn score(&self) -> f64 {
        self.score
    }

    fn with_score(self, score: f64) -> Self {
        Self { score, ..self }
    }
}

/// Returns the parameters with which boxes below the threshold are found, too.
pub(super) fn with_candidates(refinement: &RefinementParameters) -> RefinementParameters {
    RefinementParameters {
        score_threshold: refinement.score_threshold.min(taught::LEAST_SCORE),
        ..*refinement
    }
}

/// Returns the time to the next search after one that took so long.
fn search_every(took: Duration) -> Duration {
    let every = Duration::from_secs_f64(SEARCH_EVERY_S).max(took * SEARCH_TIMES);
    every.min(MAX_SEARCH_EVERY)
}

/// Returns the seconds since the Unix epoch.
fn seconds(at: Timestamp) -> f64 {
    at.as_duration().as_secs_f64()
}

/// Returns the cells of a frame whose middle can show a person.
fn visible_cells(signature: &FrameSignature, rig: &CameraRig) -> Arc<[bool]> {
    let cells = signature.cells();
    cells.map(|cell| rig.shows(middle(cell))).collect()
}

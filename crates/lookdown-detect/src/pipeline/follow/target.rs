//! A followed person: its expected place, and its confirmation by a crop.

use jiff::{SignedDuration, Timestamp};
use lookdown_lens::geometry::OrientedBox;
use nalgebra::{Point2, Vector2};

use crate::{
    detection::{BBox, FramePixels},
    pipeline::{Person, camera_rig::CameraRig, merge},
};

/// The margin around a person's box that belongs to the person, as a share of its larger side. It
/// holds shadows and the next step.
const MARGIN: f64 = 0.5;
/// Most logit by which a score from a crop is moved toward that of the last search, which may have
/// missed a person behind another one.
const MAX_GAIN: f64 = 1.0;
/// Longest time for which a person in motion whom a search has missed is still expected.
const MISSED: SignedDuration = SignedDuration::from_secs(1);
/// The score of a search that does not find a person who is there or was there.
const MISSED_SCORE: f64 = 0.05;
/// Least IoU of an expected box and a found one of the same person.
pub(super) const SAME_IOU: f64 = 0.3;

/// A followed person.
#[derive(Clone)]
pub(super) struct Target {
    /// The person at its last place.
    pub(super) person: Person,
    /// False while no crop confirms the person.
    pub(super) is_seen: bool,
    /// Its motion, pixels per second.
    velocity: Vector2<f64>,
    /// The time of its last place.
    at: Timestamp,
    /// The box around all its places since the last search.
    pub(super) trail: [f64; 4],
    /// Its box and its score in the last search.
    searched: (OrientedBox, f64),
    /// The logit of its score in the last search, less that of its first crop, within bounds.
    gain: Option<f64>,
}

impl Target {
    pub(super) fn new(person: Person, at: Timestamp, before: Option<&Self>) -> Self {
        let mut target = Self {
            is_seen: true,
            velocity: Vector2::zeros(),
            at,
            trail: person.bbox.corners(),
            searched: (person.oriented_box, person.score),
            gain: None,
            person,
        };
        if let Some(before) = before {
            target.velocity = before.velocity_to(&target.person.bbox, at);
        }
        target
    }

    /// Returns the person, in motion and lost by a search, for crops at its expected place.
    fn missed(&self, at: Timestamp) -> Option<Self> {
        let is_recent = at.duration_since(self.at) < MISSED;
        let is_in_motion = self.gain.is_some();
        (is_recent && is_in_motion).then(|| Self {
            is_seen: false,
            ..self.clone()
        })
    }

    /// Returns the expected box at a time.
    pub(super) fn expected(&self, at: Timestamp) -> [f64; 4] {
        let moved = self.velocity * at.duration_since(self.at).as_secs_f64();
        let [x_min, y_min, x_max, y_max] = self.person.bbox.corners();
        [
            x_min + moved.x,
            y_min + moved.y,
            x_max + moved.x,
            y_max + moved.y,
        ]
    }

    /// Returns the pixels whose motion belongs to the person at a time.
    pub(super) fn surroundings(&self, at: Timestamp) -> [f64; 4] {
        let [x_min, y_min, x_max, y_max] = hull(self.trail, self.expected(at));
        let bbox = &self.person.bbox;
        let margin = MARGIN * bbox.width().max(bbox.height());
        widened([x_min, y_min, x_max, y_max], margin)
    }

    /// Returns the mean of the motion so far and that to a box.
    pub(super) fn velocity_to(&self, bbox: &BBox<FramePixels>, at: Timestamp) -> Vector2<f64> {
        let seconds = at.duration_since(self.at).as_secs_f64();
        if seconds <= 0.0 {
            return self.velocity;
        }
        let moved = Point2::from(bbox.center()) - Point2::from(self.person.bbox.center());
        (self.velocity + moved / seconds) / 2.0
    }

    /// Moves to a person found in a crop, with the odds and the proportions of the last search.
    pub(super) fn confirm(&mut self, found: &Person, at: Timestamp, rig: &CameraRig) {
        let (searched, score) = self.searched;
        let gain = logit(score) - logit(found.score);
        let gain = *self.gain.get_or_insert(gain.clamp(-MAX_GAIN, MAX_GAIN));
        let score = from_logit(logit(found.score) + gain);
        let oriented_box = OrientedBox {
            width: searched.width,
            height: searched.height,
            ..found.oriented_box
        };
        let oriented_box = oriented_box.fitted_to(found.bbox.corners());
        self.velocity = self.velocity_to(&found.bbox, at);
        self.trail = hull(self.trail, found.bbox.corners());
        self.at = at;
        self.is_seen = true;
        self.person = merge::placed(found.bbox, score, oriented_box, found.views, rig);
    }
}

/// Returns the persons of a search as targets, with the motion of those that were there before, and
/// persons in motion that the search has missed.
///
/// Until the next search, a person without motion has the mean of its score and of that before. If
/// all frames were searched, a single lucky score would not be repeated.
pub(super) fn targets_of(
    persons: &[Person],
    at: Timestamp,
    before: Option<&[Target]>,
) -> Vec<Target> {
    let is_first = before.is_none();
    let before = before.unwrap_or_default();
    let mut is_found = vec![false; before.len()];
    let expected: Vec<_> = before
        .iter()
        .map(|target| BBox::new(target.expected(at)).ok())
        .collect();
    let mut targets = Vec::with_capacity(persons.len());
    for person in persons {
        let overlaps = expected.iter().enumerate().filter_map(|(index, expected)| {
            let iou = expected.as_ref()?.iou(&person.bbox);
            (iou >= SAME_IOU).then_some((iou, index))
        });
        let nearest = overlaps.max_by(|a, b| a.0.total_cmp(&b.0));
        let nearest = nearest.map(|(_, index)| {
            is_found[index] = true;
            &before[index]
        });
        let mut target = Target::new(person.clone(), at, nearest);
        if !is_first {
            let score = nearest.map_or(MISSED_SCORE, |target| target.person.score);
            let mean = f64::midpoint(logit(score), logit(person.score));
            target.person.score = from_logit(mean);
        }
        targets.push(target);
    }
    let missed = before
        .iter()
        .zip(is_found)
        .filter(|(_, is_found)| !is_found);
    targets.extend(missed.filter_map(|(target, _)| target.missed(at)));
    targets
}

pub(super) fn hull(one: [f64; 4], other: [f64; 4]) -> [f64; 4] {
    [
        one[0].min(other[0]),
        one[1].min(other[1]),
        one[2].max(other[2]),
        one[3].max(other[3]),
    ]
}

pub(super) fn widened([x_min, y_min, x_max, y_max]: [f64; 4], margin: f64) -> [f64; 4] {
    [
        x_min - margin,
        y_min - margin,
        x_max + margin,
        y_max + margin,
    ]
}

pub(super) fn overlap(one: &[f64; 4], other: &[f64; 4]) -> bool {
    one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3]
}

fn logit(score: f64) -> f64 {
    let score = score.clamp(1e-6, 1.0 - 1e-6);
    (score / (1.0 - score)).ln()
}

fn from_logit(logit: f64) -> f64 {
    1.0 / (1.0 + (-logit).exp())
}

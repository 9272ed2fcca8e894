//! A followed person: its expected place, and its confirmation by a crop.

use lookdown_lens::geometry::{
    OrientedBox,
    hull::{hull, middle},
};
use nalgebra::Vector2;

/// The margin around a person's box that belongs to the person, as a share of its larger side. It
/// holds shadows and the next step.
const MARGIN: f64 = 0.5;
/// Most logit by which a score from a crop is moved toward that of the last search, which may have
/// missed a person behind another one.
const MAX_GAIN: f64 = 1.0;
/// Speed of a person whose motion is not known, larger sides of its box per second: 2.2 m/s for one
/// of 1.7 m. With .82 here, .3 below and narrow crops, 83 instead of 44 % of the frames of six
/// walkers at 2.5 frames/s are searched, and all instead of 57 % at 1.7; the number is the same.
const UNKNOWN_SPEED: f64 = 1.3;
/// Change of the speed of a person whose motion is known, in the same unit: .8 m/s. Added to
/// [`SPEED_CHANGE`] times its own speed, because people turn and stop.
const KNOWN_SPEED: f64 = 0.5;
/// Change of a known speed, as its share.
const SPEED_CHANGE: f64 = 0.3;
/// A box without overlap is the same person up to this multiple of how far it may be: with 1, 75
/// instead of 57 % of those frames are searched, because someone seems lost.
const MATCHED_DRIFTS: f64 = 2.0;
/// Longest time for which a person in motion whom a search has missed is still expected, seconds.
const MISSED_S: f64 = 1.0;
/// A person of this score or more who is lost is a reason to search: the default least score of a
/// report. Boxes of lower scores come and go with the noise of a camera.
const PERSON_SCORE: f64 = 0.3;
/// A score is settled if its logit differs from that of the last search by at most this, as .3 and
/// .4 do.
const SETTLED_LOGIT: f64 = 0.5;
/// The score of a search that does not find a person who is there or was there.
const MISSED_SCORE: f64 = 0.05;
/// Least IoU of an expected box and a found one of the same person.
const SAME_IOU: f64 = 0.3;

/// A followed person.
#[derive(Debug, Clone)]
pub(super) struct Target<P> {
    /// The person at its last place.
    pub(super) person: P,
    /// False while no crop confirms the person.
    pub(super) is_seen: bool,
    /// Its motion, pixels per second; zero while it was seen only once.
    velocity: Vector2<f64>,
    /// True once it was seen at two times.
    is_motion_known: bool,
    /// The time of its last place, seconds.
    at_s: f64,
    /// The box around all its places since the last search.
    trail: [f64; 4],
    /// Its box and its score in the last search.
    searched: (OrientedBox, f64),
    /// The logit of its score in the last search, less that of its first crop, within bounds.
    gain: Option<f64>,
}

impl<P: FoundPerson> Target<P> {
    pub(super) fn new(person: P, at_s: f64, before: Option<&Self>) -> Self {
        let bounds = person.bounds();
        Self {
            is_seen: true,
            velocity: before.map_or_else(Vector2::zeros, |one| one.velocity_to(&bounds, at_s)),
            is_motion_known: before.is_some(),
            at_s,
            trail: bounds,
            searched: (person.upright_box(), person.score()),
            gain: None,
            person,
        }
    }

    /// Returns true if the person is in the report.
    pub(super) fn is_reported(&self) -> bool {
        self.is_seen && self.person.score() >= PERSON_SCORE
    }

    /// Returns true if the person is seen with about the score of the last search, or not reported
    /// with either of them.
    pub(super) fn is_settled(&self) -> bool {
        let [now, searched] = [self.person.score(), self.searched.1];
        let is_person = now.max(searched) >= PERSON_SCORE;
        let is_alike = (logit(now) - logit(searched)).abs() <= SETTLED_LOGIT;
        self.is_seen && (is_alike || !is_person)
    }

    /// Returns the person, in motion and lost by a search, for crops at its expected place.
    fn missed(&self, at_s: f64) -> Option<Self> {
        let is_recent = at_s - self.at_s < MISSED_S;
        let is_in_motion = self.gain.is_some();
        (is_recent && is_in_motion).then(|| Self {
            is_seen: false,
            ..self.clone()
        })
    }

    /// Returns the expected box at a time.
    pub(super) fn expected(&self, at_s: f64) -> [f64; 4] {
        let moved = self.velocity * (at_s - self.at_s);
        let [x_min, y_min, x_max, y_max] = self.person.bounds();
        [
            x_min + moved.x,
            y_min + moved.y,
            x_max + moved.x,
            y_max + moved.y,
        ]
    }

    /// Returns how far the person may be from its expected place at a time, in larger sides of its
    /// box: from its speed and the time since its last place.
    pub(super) fn drift(&self, at_s: f64) -> f64 {
        let speed = if self.is_motion_known {
            KNOWN_SPEED + SPEED_CHANGE * self.velocity.norm() / self.side_px()
        } else {
            UNKNOWN_SPEED
        };
        speed * (at_s - self.at_s)
    }

    /// Returns the larger side of the person's box, pixels.
    fn side_px(&self) -> f64 {
        let upright = self.person.upright_box();
        upright.width.max(upright.height)
    }

    /// Returns how much a box at a time is like the person, 0 to 1: the IoU with the expected box,
    /// and less than [`SAME_IOU`] for one that the person may have reached. `None` for another
    /// person.
    fn likeness(&self, bounds: &[f64; 4], at_s: f64) -> Option<f64> {
        let expected = self.expected(at_s);
        let iou = iou(&expected, bounds);
        let way = (middle(*bounds) - middle(expected)).norm() / self.side_px();
        let nearness = 1.0 - way / (MATCHED_DRIFTS * self.drift(at_s));
        let likeness = if iou < SAME_IOU {
            SAME_IOU * nearness
        } else {
            iou
        };
        (likeness > 0.0).then_some(likeness)
    }

    /// Returns the box around all places since the last search and the one expected at a time.
    pub(super) fn places(&self, at_s: f64) -> [f64; 4] {
        hull(self.trail, self.expected(at_s))
    }

    /// Returns the pixels whose motion belongs to the person at a time.
    pub(super) fn surroundings(&self, at_s: f64) -> [f64; 4] {
        let [x_min, y_min, x_max, y_max] = self.person.bounds();
        let margin = MARGIN.max(self.drift(at_s)) * (x_max - x_min).max(y_max - y_min);
        widened(self.places(at_s), margin)
    }

    /// Returns the mean of the motion so far and that to a box.
    fn velocity_to(&self, bounds: &[f64; 4], at_s: f64) -> Vector2<f64> {
        let seconds = at_s - self.at_s;
        if seconds <= 0.0 {
            return self.velocity;
        }
        let moved = middle(*bounds) - middle(self.person.bounds());
        (self.velocity + moved / seconds) / 2.0
    }

    /// Moves to a person found in a crop, with the odds and the proportions of the last search.
    /// `place` returns a found person with another score and another oriented box.
    pub(super) fn confirm(
        &mut self,
        found: &P,
        at_s: f64,
        place: impl FnOnce(&P, f64, OrientedBox) -> P,
    ) {
        let (searched, score) = self.searched;
        let gain = logit(score) - logit(found.score());
        let gain = *self.gain.get_or_insert(gain.clamp(-MAX_GAIN, MAX_GAIN));
        let score = from_logit(logit(found.score()) + gain);
        let upright_box = OrientedBox {
            width: searched.width,
            height: searched.height,
            ..found.upright_box()
        };
        let bounds = found.bounds();
        self.velocity = self.velocity_to(&bounds, at_s);
        self.is_motion_known = true;
        self.trail = hull(self.trail, bounds);
        self.at_s = at_s;
        self.is_seen = true;
        self.person = place(found, score, upright_box.fitted_to(bounds));
    }
}

/// Returns the persons of a search as targets, with the motion of those that were there before, and
/// persons in motion that the search has missed; and all that it has missed.
///
/// Until the next search, a person without motion has the mean of its score and of that before. If
/// all frames were searched, a single lucky score would not be repeated.
pub(super) fn targets_of<'a, P: FoundPerson>(
    persons: &[P],
    at_s: f64,
    before: Option<&'a [Target<P>]>,
) -> (Vec<Target<P>>, Vec<&'a Target<P>>) {
    let is_first = before.is_none();
    let before = before.unwrap_or_default();
    let same = same_persons(before, persons, at_s, 0.0);
    let mut targets = Vec::with_capacity(persons.len());
    for (number, person) in persons.iter().enumerate() {
        let index = same.iter().position(|same| *same == Some(number));
        let known = index.map(|index| &before[index]);
        let mut target = Target::new(person.clone(), at_s, known);
        if !is_first {
            let score = known.map_or(MISSED_SCORE, |target| target.person.score());
            let mean = f64::midpoint(logit(score), logit(person.score()));
            target.person = target.person.with_score(from_logit(mean));
        }
        targets.push(target);
    }
    let missed = before.iter().zip(same);
    let missed = missed.filter(|(_, same)| same.is_none());
    let missed: Vec<_> = missed.map(|(target, _)| target).collect();
    targets.extend(missed.iter().filter_map(|target| target.missed(at_s)));
    (targets, missed)
}

/// Returns for each target the index of the found person that it is. Persons from `least_score` on
/// are first, because a weak box between two people may overlap the expected place most.
pub(super) fn same_persons<P: FoundPerson>(
    targets: &[Target<P>],
    found: &[P],
    at_s: f64,
    least_score: f64,
) -> Vec<Option<usize>> {
    let mut pairs = Vec::new();
    for (number, person) in found.iter().enumerate() {
        for (index, target) in targets.iter().enumerate() {
            if let Some(likeness) = target.likeness(&person.bounds(), at_s) {
                pairs.push((person.score() < least_score, likeness, index, number));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    let mut same = vec![None; targets.len()];
    for (_, _, index, number) in pairs {
        if same[index].is_none() && !same.contains(&Some(number)) {
            same[index] = Some(number);
        }
    }
    same
}

/// A person that was found in a frame.
pub trait FoundPerson: Clone {
    /// The box `[x_min, y_min, x_max, y_max]`, corner-origin frame pixels.
    fn bounds(&self) -> [f64; 4];
    /// The box in the frame along the projected vertical.
    fn upright_box(&self) -> OrientedBox;
    /// The score, a probability.
    fn score(&self) -> f64;
    /// Returns the person with another score.
    fn with_score(self, score: f64) -> Self;
}

/// Least distance of a probability from 0 and from 1, for a finite logit.
const LEAST: f64 = 1e-6;

/// Returns the logit of a probability.
pub fn logit(score: f64) -> f64 {
    let score = score.clamp(LEAST, 1.0 - LEAST);
    (score / (1.0 - score)).ln()
}

/// Returns the probability of a logit.
pub fn from_logit(logit: f64) -> f64 {
    1.0 / (1.0 + (-logit).exp())
}

/// Returns a box with a margin (pixels) on all sides.
pub fn widened([x_min, y_min, x_max, y_max]: [f64; 4], margin: f64) -> [f64; 4] {
    [
        x_min - margin,
        y_min - margin,
        x_max + margin,
        y_max + margin,
    ]
}

/// Returns true if two boxes share more than a border.
pub fn overlap(one: &[f64; 4], other: &[f64; 4]) -> bool {
    one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3]
}

/// Returns the intersection over union, 0 to 1.
fn iou(one: &[f64; 4], other: &[f64; 4]) -> f64 {
    let side = |at: usize| (one[at + 2].min(other[at + 2]) - one[at].max(other[at])).max(0.0);
    let area = |of: &[f64; 4]| (of[2] - of[0]) * (of[3] - of[1]);
    let both = side(0) * side(1);
    let union = area(one) + area(other) - both;
    if union > 0.0 { both / union } else { 0.0 }
}

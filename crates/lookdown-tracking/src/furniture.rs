//! Memory of a place: what has stood at one place with one shape for hours is furniture.
//!
//! The evidence of a track (`evidence.rs`) ends with the track, and counts a thing that stands
//! still as a few reports. This memory begins where the evidence ends: a track that is confirmed
//! and never moved on from its first place starts a [`Thing`], whose time of presence adds up over
//! tracks.
//!
//! A person who sits moves: the smoothed box leaves its first place or changes its size, and the
//! time begins again. `docs/lab/count-accuracy.md` has the measured motions of things and persons.

use serde::{Deserialize, Serialize};

use crate::{Observation, evidence::log_odds};

/// Seconds of observed presence after which a thing is furniture.
pub const FURNITURE_AFTER_S: f64 = 7200.0;
/// Most things of a camera.
pub const MAX_THINGS: usize = 64;
/// Longest time between two reports that is observed, seconds.
pub const LONGEST_OBSERVED_S: f64 = 10.0;
/// A track starts a thing after this many seconds at its first place.
pub(super) const START_AFTER_S: f64 = 30.0;

/// Time constant of the smoothed box, seconds.
const SMOOTHED_S: f64 = 10.0;
/// Time constant in which furniture follows slow changes of the light, seconds.
const DRIFT_S: f64 = 3600.0;
/// Presence after which the first box of a thing is settled, seconds.
const SETTLED_S: f64 = 30.0;
/// Most of a deviation that one report adds to the smoothed box.
const CLIP: f64 = 0.1;
/// The smoothed box of a thing that stands still stays within these deviations.
const STILL: Gate = Gate {
    center: 0.05,
    size: 0.08,
    score: f64::INFINITY,
};
/// A box within these deviations may be the thing that has moved, or a person in its place.
const SAME_PLACE: Gate = Gate {
    center: 0.35,
    size: 0.4,
    score: f64::INFINITY,
};
/// A box within these deviations shows the furniture itself.
const SAME_THING: Gate = Gate {
    center: 0.12,
    size: 0.15,
    score: 1.5,
};
/// A candidate is forgotten after this observed time without it, seconds.
const CANDIDATE_MISSING_S: f64 = 120.0;
/// Furniture is forgotten after this observed time without it, seconds.
const FURNITURE_MISSING_S: f64 = 86_400.0;
/// Furniture is forgotten after this observed time with something else in its place, seconds.
const REPLACED_S: f64 = 3600.0;

/// Largest deviations: of the center in square roots of the area, of the logarithms of width and
/// height, and by how much the log odds of the score may be higher.
struct Gate {
    center: f64,
    size: f64,
    score: f64,
}

/// A box with its score, as it is compared.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Shape {
    center_px: [f64; 2],
    /// Logarithms of width and height.
    log_size: [f64; 2],
    log_odds: f64,
}

/// The state of a thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ThingState {
    /// It counts as a person until it is furniture.
    Candidate,
    /// Furniture by its time of presence.
    Remembered,
    /// Furniture by a decision of the user.
    Confirmed,
    /// Never furniture, by a decision of the user.
    TakenBack,
}

/// A thing that stands at one place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Thing {
    /// The identifier, unique per camera.
    pub id: u64,
    /// The state.
    pub state: ThingState,
    /// The box at the begin of its presence; that of furniture follows slow changes.
    first: Shape,
    smoothed: Shape,
    /// The observed time of its presence, seconds.
    pub present_s: f64,
    /// Observed time since the thing was seen.
    missing_s: f64,
    /// Part of it in which something else was in its place.
    replaced_s: f64,
}

/// The things of a camera.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Furniture {
    things: Vec<Thing>,
    last_id: u64,
}

impl Shape {
    fn new(person: &Observation) -> Self {
        Self {
            center_px: person.center_px,
            log_size: person.size_px.map(f64::ln),
            log_odds: log_odds(person.score),
        }
    }

    fn is_finite(&self) -> bool {
        let values = self.center_px.iter().chain(&self.log_size);
        values
            .chain([&self.log_odds])
            .all(|value| value.is_finite())
    }

    /// The unit of distances: the square root of the area.
    fn unit_px(&self) -> f64 {
        f64::midpoint(self.log_size[0], self.log_size[1]).exp()
    }

    /// Distance of the centers, in units of this box.
    fn distance(&self, other: &Self) -> f64 {
        let [x, y] = self.center_px;
        let [other_x, other_y] = other.center_px;
        (x - other_x).hypot(y - other_y) / self.unit_px()
    }

    fn holds(&self, other: &Self, gate: &Gate) -> bool {
        let sizes = self.log_size.iter().zip(&other.log_size);
        self.distance(other) <= gate.center
            && sizes
                .into_iter()
                .all(|(one, other)| (one - other).abs() <= gate.size)
            && other.log_odds - self.log_odds <= gate.score
    }

    /// Moves a share of the way to another box. One box far away moves it by a little only.
    fn approach(&mut self, other: &Self, share: f64) {
        let unit_px = self.unit_px();
        for (value, other) in self.center_px.iter_mut().zip(other.center_px) {
            *value += share * (other - *value).clamp(-CLIP * unit_px, CLIP * unit_px);
        }
        for (value, other) in self.log_size.iter_mut().zip(other.log_size) {
            *value += share * (other - *value).clamp(-CLIP, CLIP);
        }
        self.log_odds += share * (other.log_odds - self.log_odds);
    }
}

impl Thing {
    /// Returns the center of the box in frame pixels.
    pub fn center_px(&self) -> [f64; 2] {
        self.smoothed.center_px
    }

    /// Returns width and height of the oriented box in frame pixels.
    pub fn size_px(&self) -> [f64; 2] {
        self.smoothed.log_size.map(f64::exp)
    }

    /// Returns true if it is not counted.
    pub fn is_furniture(&self) -> bool {
        matches!(self.state, ThingState::Remembered | ThingState::Confirmed)
    }

    /// The gate of its boxes.
    fn gate(&self) -> &'static Gate {
        match self.state {
            ThingState::Remembered | ThingState::Confirmed => &SAME_THING,
            ThingState::Candidate | ThingState::TakenBack => &SAME_PLACE,
        }
    }

    fn see(&mut self, shape: &Shape, observed_s: f64) {
        (self.missing_s, self.replaced_s) = (0.0, 0.0);
        self.smoothed
            .approach(shape, -(-observed_s / SMOOTHED_S).exp_m1());
        self.present_s += observed_s;
        if self.state != ThingState::Candidate {
            self.first
                .approach(&self.smoothed, -(-observed_s / DRIFT_S).exp_m1());
        } else if self.present_s <= SETTLED_S {
            self.first = self.smoothed;
        } else if !self.first.holds(&self.smoothed, &STILL) {
            self.first = self.smoothed;
            self.present_s = 0.0;
        } else if self.present_s >= FURNITURE_AFTER_S {
            self.state = ThingState::Remembered;
        }
    }

    fn miss(&mut self, is_replaced: bool, observed_s: f64) {
        self.missing_s += observed_s;
        if is_replaced {
            self.replaced_s += observed_s;
        }
    }

    fn is_forgotten(&self) -> bool {
        match self.state {
            ThingState::Candidate => self.missing_s > CANDIDATE_MISSING_S,
            _ => self.missing_s > FURNITURE_MISSING_S || self.replaced_s > REPLACED_S,
        }
    }
}

impl Furniture {
    /// Returns the things in order of their identifiers, without those that were taken back.
    pub fn things(&self) -> impl Iterator<Item = &Thing> {
        let things = self.things.iter();
        things.filter(|thing| thing.state != ThingState::TakenBack)
    }

    /// Makes a thing furniture. Returns false for an unknown identifier.
    pub fn confirm(&mut self, id: u64) -> bool {
        self.decide(id, ThingState::Confirmed)
    }

    /// Counts a thing as a person, as long as it stays there. Returns false for an unknown
    /// identifier.
    pub fn take_back(&mut self, id: u64) -> bool {
        self.decide(id, ThingState::TakenBack)
    }

    fn decide(&mut self, id: u64, state: ThingState) -> bool {
        let mut things = self.things.iter_mut();
        let thing = things.find(|thing| thing.id == id && thing.state != ThingState::TakenBack);
        thing.map(|thing| thing.state = state).is_some()
    }

    /// Updates the things with the persons of a report, `observed_s` after the last one. Returns
    /// the thing that each person shows.
    pub(super) fn update(
        &mut self,
        persons: &[&Observation],
        observed_s: f64,
    ) -> Vec<Option<Thing>> {
        let observed_s = if (0.0..=LONGEST_OBSERVED_S).contains(&observed_s) {
            observed_s
        } else {
            0.0
        };
        let shapes: Vec<Shape> = persons.iter().map(|person| Shape::new(person)).collect();
        let mut pairs = Vec::new();
        for (thing, known) in self.things.iter().enumerate() {
            for (person, shape) in shapes.iter().enumerate() {
                if shape.is_finite() && known.smoothed.holds(shape, known.gate()) {
                    pairs.push((known.smoothed.distance(shape), thing, person));
                }
            }
        }
        pairs.sort_by(|one, other| one.0.total_cmp(&other.0));
        let mut shown = vec![None; persons.len()];
        let mut seen = vec![false; self.things.len()];
        for (_, thing, person) in pairs {
            if shown[person].is_none() && !seen[thing] {
                self.things[thing].see(&shapes[person], observed_s);
                shown[person] = Some(self.things[thing]);
                seen[thing] = true;
            }
        }
        for (thing, _) in self
            .things
            .iter_mut()
            .zip(&seen)
            .filter(|(_, seen)| !**seen)
        {
            let first = &thing.smoothed;
            let is_replaced = shapes
                .iter()
                .any(|shape| first.distance(shape) <= SAME_PLACE.center);
            thing.miss(is_replaced, observed_s);
        }
        self.things.retain(|thing| !thing.is_forgotten());
        shown
    }

    /// Starts a thing.
    pub(super) fn start(&mut self, person: &Observation) {
        let shape = Shape::new(person);
        if !shape.is_finite() {
            return;
        }
        if self.things.len() >= MAX_THINGS {
            let candidates = self.things.iter().enumerate();
            let candidates = candidates
                .filter(|(_, thing)| thing.state == ThingState::Candidate && thing.missing_s > 0.0);
            let longest =
                candidates.max_by(|(_, one), (_, other)| one.missing_s.total_cmp(&other.missing_s));
            let Some((index, _)) = longest else { return };
            self.things.remove(index);
        }
        self.last_id += 1;
        self.things.push(Thing {
            id: self.last_id,
            state: ThingState::Candidate,
            first: shape,
            smoothed: shape,
            present_s: 0.0,
            missing_s: 0.0,
            replaced_s: 0.0,
        });
    }
}

#[cfg(test)]
mod tests;

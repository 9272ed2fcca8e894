//! Follows the people of a camera from one search of the frame to the next.
//!
//! After a search, motion where no person was needs another search. Motion at a person needs a crop
//! where that person is expected; people without motion stay as they were. A crop has one vote
//! instead of those of all views, so that each person keeps the odds that the search gave it
//! relative to its first crop. The caller detects motion, places crops and finds people in them.

mod target;

use lookdown_lens::geometry::OrientedBox;

pub use self::target::{FoundPerson, from_logit, logit, overlap, widened};
use self::target::{Target, same_persons, targets_of};

/// Time from a search to the next one, seconds: a little less than a second, because frames jitter.
pub const SEARCH_EVERY_S: f64 = 0.9;
/// Cells with motion belong to the same motion if at most this many cells less one lie between
/// them.
pub const JOINED_CELLS: f64 = 2.0;

/// Least share of a crop's side that followed people may fill. A frame with someone who may be
/// beyond such a crop needs a search.
pub const LEAST_FILL: f64 = 0.3;

/// The people of a camera since the last search of its frame.
#[derive(Debug, Clone)]
pub struct FollowedPeople<P> {
    targets: Vec<Target<P>>,
    /// True if the search has not found someone who was reported before it.
    has_missed: bool,
}

impl<P: FoundPerson> FollowedPeople<P> {
    /// Takes the people of a search at `at_s` (seconds), with the motion of those before it. A
    /// person in motion whom the search has missed is expected for a second.
    pub fn from_search(persons: &[P], at_s: f64, before: Option<&Self>) -> Self {
        let before = before.map(|before| before.targets.as_slice());
        let (targets, missed) = targets_of(persons, at_s, before);
        Self {
            targets,
            has_missed: missed.iter().any(|target| target.is_reported()),
        }
    }

    /// Returns true if another search of a frame without motion would tell nothing more: the last
    /// one has found everyone who was reported before, all with the scores that they had, and
    /// everyone is seen since.
    pub fn are_settled(&self) -> bool {
        !self.has_missed && self.targets.iter().all(Target::is_settled)
    }

    /// Returns the share of a crop's side that people may fill at most if crops at their expected
    /// places are to show everyone in motion who is seen at `at_s` (seconds), 0 to 1.
    pub fn most_fill(&self, moving: &[bool], at_s: f64) -> f64 {
        let seen = self.targets.iter().zip(moving);
        let seen = seen.filter(|(target, is_moving)| **is_moving && target.is_seen);
        let drifts = seen.map(|(target, _)| target.drift(at_s));
        1.0 / (1.0 + 2.0 * drifts.fold(0.0, f64::max))
    }

    /// Returns true if `after` lacks someone who is seen here, or has a score below `least_score`
    /// instead. The frame of `after` needs a search.
    pub fn are_lost_in(&self, after: &Self, least_score: f64) -> bool {
        let mut both = self.targets.iter().zip(&after.targets);
        both.any(|(before, after)| {
            before.is_reported() && !(after.is_seen && after.person.score() >= least_score)
        })
    }

    /// Returns for each person whether there is motion where it was or is expected at `at_s`
    /// (seconds). `moved` are boxes with motion, frame pixels.
    pub fn moving(&self, moved: &[[f64; 4]], at_s: f64) -> Vec<bool> {
        let moving = self.targets.iter().map(|target| {
            let places = target.places(at_s);
            !target.is_seen || moved.iter().any(|one| overlap(&places, one))
        });
        moving.collect()
    }

    /// Returns the indices of boxes with motion that are joined to no person, as shadows are. Boxes
    /// are joined if at most `reach_px` pixels lie between them.
    pub fn unexplained(&self, moved: &[[f64; 4]], reach_px: f64, at_s: f64) -> Vec<usize> {
        let surroundings = self.targets.iter().map(|target| target.surroundings(at_s));
        let surroundings: Vec<_> = surroundings.collect();
        let is_near = |index: &usize| {
            let of_person = |all: &[f64; 4]| overlap(all, &moved[*index]);
            surroundings.iter().any(of_person)
        };
        let (mut joined, mut others): (Vec<_>, Vec<_>) = (0..moved.len()).partition(is_near);
        while let Some(index) = joined.pop() {
            let reach = widened(moved[index], reach_px);
            let is_joined = |other: &usize| overlap(&reach, &moved[*other]);
            let (near, far): (Vec<_>, _) = others.into_iter().partition(is_joined);
            joined.extend(near);
            others = far;
        }
        others
    }

    /// Returns the people for whom `moving` holds, with their expected boxes at `at_s` (seconds).
    pub fn expected<'a>(
        &'a self,
        moving: &'a [bool],
        at_s: f64,
    ) -> impl Iterator<Item = (&'a P, [f64; 4])> {
        let targets = self.targets.iter().zip(moving);
        let targets = targets.filter(|(_, is_moving)| **is_moving);
        targets.map(move |(target, _)| (&target.person, target.expected(at_s)))
    }

    /// Confirms people in motion by those found in crops at `at_s` (seconds). Others from
    /// `least_score` on become people of their own. `place` returns a found person with another
    /// score and another oriented box.
    pub fn confirm(
        &mut self,
        moving: &[bool],
        found: Vec<P>,
        at_s: f64,
        least_score: f64,
        place: impl Fn(&P, f64, OrientedBox) -> P,
    ) {
        let same = same_persons(&self.targets, &found, at_s, least_score);
        let targets = self.targets.iter_mut().zip(moving);
        for ((target, is_moving), same) in targets.zip(&same) {
            target.is_seen = same.is_some() || !is_moving;
            // Persons without motion stay as they were.
            if let (Some(number), true) = (*same, *is_moving) {
                target.confirm(&found[number], at_s, &place);
            }
        }
        for (number, other) in found.into_iter().enumerate() {
            if other.score() >= least_score && !same.contains(&Some(number)) {
                self.targets.push(Target::new(other, at_s, None));
            }
        }
    }

    /// Returns the people that are seen.
    pub fn seen(&self) -> impl Iterator<Item = &P> {
        let seen = self.targets.iter().filter(|target| target.is_seen);
        seen.map(|target| &target.person)
    }
}

#[cfg(test)]
mod tests;

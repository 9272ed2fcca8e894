//! The persons of a report that tracks are made of, with their measurements.

use std::collections::BTreeSet;

use crate::{CameraPose, Observation, TrackerSettings, furniture::Thing, measurement::Measurement};

/// Most persons of a report that are considered: those with the highest scores.
pub const MAX_PERSONS: usize = 300;

/// A person of the current report with its measurement.
pub(super) struct Candidate<'a> {
    pub index: usize,
    pub person: &'a Observation,
    pub measured: Measurement,
}

/// The persons of a report, without furniture.
pub(super) struct Separated<'a> {
    pub candidates: Vec<Candidate<'a>>,
    /// The measurements of the furniture.
    pub furniture: Vec<Measurement>,
    /// Indices of the persons that show no known thing.
    pub unknown: BTreeSet<usize>,
}

/// Returns the persons that count, in an order that does not depend on the report's. `on_floor` is
/// true if places are on the floor.
pub(super) fn candidates<'a>(
    persons: &'a [Observation],
    (camera, pose, on_floor): (usize, &CameraPose, bool),
    settings: &TrackerSettings,
) -> Vec<Candidate<'a>> {
    let noise = &settings.noise;
    let measure = |person| match pose.height_m {
        Some(height_m) if on_floor => {
            Measurement::on_floor(person, (camera, pose), height_m, noise)
        }
        _ => Measurement::from_bearing(person, noise),
    };
    let mut candidates: Vec<_> = persons
        .iter()
        .enumerate()
        .filter(|(_, person)| person.score >= settings.low_score)
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
    without_parts(candidates, settings.least_score_in_line)
}

/// Drops persons below a score that may be a part of a stronger one, or the same one again. They
/// come in order of falling scores.
fn without_parts(candidates: Vec<Candidate>, least_score: f64) -> Vec<Candidate> {
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in candidates {
        let one = &candidate.measured;
        let is_weak = one.score < least_score;
        if !is_weak || !kept.iter().any(|other| one.is_part_of(&other.measured)) {
            kept.push(candidate);
        }
    }
    kept
}

/// Separates the furniture from the persons. `shown` has the thing that each candidate shows.
pub(super) fn separate<'a>(
    candidates: Vec<Candidate<'a>>,
    shown: &[Option<Thing>],
) -> Separated<'a> {
    let mut separated = Separated {
        candidates: Vec::new(),
        furniture: Vec::new(),
        unknown: BTreeSet::new(),
    };
    for (candidate, thing) in candidates.into_iter().zip(shown) {
        if thing.is_some_and(|thing| thing.is_furniture()) {
            separated.furniture.push(candidate.measured);
            continue;
        }
        if thing.is_none() {
            separated.unknown.insert(candidate.index);
        }
        separated.candidates.push(candidate);
    }
    separated
}

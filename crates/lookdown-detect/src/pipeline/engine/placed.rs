//! The persons of a frame by the places of their feet.

use lookdown_lens::geometry::{FootFilter, FootPlace};

use crate::pipeline::Person;

/// The persons of a frame by the places of their feet.
#[derive(Default)]
pub(super) struct Placed {
    /// Those who count.
    pub(super) persons: Vec<Person>,
    /// Those in the margin of an area; `None` without areas.
    pub(super) margin: Option<Vec<Person>>,
    /// All others.
    pub(super) outside: Vec<Person>,
}

impl Placed {
    /// Sorts persons by the places of their feet, in their order.
    pub(super) fn new(persons: Vec<Person>, filter: &FootFilter) -> Self {
        let mut placed = Self {
            margin: (!filter.areas.is_empty()).then(Vec::new),
            ..Self::default()
        };
        for person in persons {
            match filter.place(person.oriented_box.foot(), person.floor) {
                FootPlace::Inside => placed.persons.push(person),
                FootPlace::Margin => placed.margin.get_or_insert_default().push(person),
                FootPlace::Outside => placed.outside.push(person),
            }
        }
        placed
    }

    /// Removes those of lower scores than the threshold.
    pub(super) fn retain(&mut self, score_threshold: f64) {
        let margin = self.margin.iter_mut();
        for persons in margin.chain([&mut self.persons, &mut self.outside]) {
            persons.retain(|person| person.score >= score_threshold);
        }
    }
}

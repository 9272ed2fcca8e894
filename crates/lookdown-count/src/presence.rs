//! The number of persons over the known time of a camera or a site.

use serde::{Deserialize, Serialize};

use crate::sums::{MINUTE_MS, Owner, Sums, minutes};

/// The last report and its number of persons.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Presence {
    pub(crate) last_ms: Option<i64>,
    pub(crate) persons: u64,
}

impl Presence {
    /// Returns the time since the last report if it is known: positive, and no longer than the
    /// longest gap.
    pub(crate) fn known_since(&self, at_ms: i64, longest_gap_ms: i64) -> Option<i64> {
        let last = self.last_ms?;
        (last < at_ms && at_ms - last <= longest_gap_ms).then_some(last)
    }

    /// Adds the time since the last report to the sums, and sets the number of persons.
    pub(crate) fn advance(
        &mut self,
        owner: &Owner,
        (at_ms, longest_gap_ms): (i64, i64),
        persons: u64,
        sums: &mut Sums,
    ) {
        if let Some(last) = self.known_since(at_ms, longest_gap_ms) {
            for (minute, length_ms) in minutes(last, at_ms) {
                let sum = sums.presence.entry((owner.clone(), minute)).or_default();
                sum.known_ms += length_ms;
                sum.person_ms += length_ms * self.persons;
                sum.most = sum.most.max(self.persons);
            }
        }
        if self.last_ms.is_none_or(|last| last < at_ms) {
            let minute = at_ms.div_euclid(MINUTE_MS);
            let sum = sums.presence.entry((owner.clone(), minute)).or_default();
            sum.most = sum.most.max(persons);
            *self = Self {
                last_ms: Some(at_ms),
                persons,
            };
        }
    }
}

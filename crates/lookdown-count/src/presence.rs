//! The number of persons over the known time of a camera or a site.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::sums::{MINUTE_MS, Owner, Sums, TimeSpan};

/// The last report and its number of persons.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Presence {
    pub(crate) last_ms: Option<i64>,
    pub(crate) persons: u64,
}

impl Presence {
    /// Returns the time since the last report if it is known: positive, and no longer than the
    /// longest gap.
    pub(crate) fn known(&self, time: ReportTime) -> Option<TimeSpan> {
        let (from_ms, to_ms) = (self.last_ms?, time.at_ms);
        let is_known = from_ms < to_ms && to_ms - from_ms <= time.longest_gap_ms;
        is_known.then_some(TimeSpan { from_ms, to_ms })
    }

    /// Adds the time since the last report to the sums, and sets the number of persons.
    pub(crate) fn advance(
        &mut self,
        owner: &Owner,
        time: ReportTime,
        persons: u64,
        sums: &mut Sums,
    ) {
        if let Some(known) = self.known(time) {
            for (minute, length_ms) in known.minutes() {
                let sum = sums.presence.entry((owner.clone(), minute)).or_default();
                sum.add_time(length_ms, self.persons, time.bar);
            }
        }
        let at_ms = time.at_ms;
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

/// The time of a report.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReportTime {
    /// Time of its frame, milliseconds since the Unix epoch.
    pub(crate) at_ms: i64,
    /// Longest time between two reports of a camera that is known, milliseconds.
    pub(crate) longest_gap_ms: i64,
    /// Time after which people on the floor are an alert, milliseconds; `None` for no alerts.
    pub(crate) floor_alert_after_ms: Option<i64>,
    /// The bar of the server's number: the true number is in 90 % of frames from the first of these
    /// to the second.
    pub(crate) bar: Option<[u64; 2]>,
    /// Its arrival, by a clock that never jumps.
    pub(crate) now: Instant,
}

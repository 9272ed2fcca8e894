//! The number of persons over the known time of a camera or a site.

use serde::{Deserialize, Serialize};

use crate::{
    report_time::ReportTime,
    sums::{MINUTE_MS, Owner, Sums},
    time_span::TimeSpan,
};

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

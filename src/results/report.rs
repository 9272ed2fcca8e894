//! A stored report, and the ID that gives its position in the order of all reports.
//!
//! The cameras of a query or a listener.

use std::{fmt, num::ParseIntError, str::FromStr};

use bytes::Bytes;
use jiff::Timestamp;

/// The ID of a report. It orders reports by the time at which they were stored: it is that time in
/// microseconds since 1970, or the previous ID plus one if that is larger. IDs therefore also
/// increase across restarts of the server.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ReportId(u64);

impl ReportId {
    /// Returns the ID that follows `last` at the time `now`.
    pub fn next(last: Self, now: Timestamp) -> Self {
        Self::at(now).max(Self(last.0.saturating_add(1)))
    }

    /// Returns the ID of a report that was stored at this time. Times before 1970 count as 1970.
    pub fn at(time: Timestamp) -> Self {
        Self(u64::try_from(time.as_microsecond()).unwrap_or(0))
    }

    /// Returns the ID of this number.
    pub(super) fn from_micros(micros: u64) -> Self {
        Self(micros)
    }

    /// The time at which the report was stored, to the microsecond.
    pub fn time(self) -> Timestamp {
        let micros = i64::try_from(self.0).unwrap_or(i64::MAX);
        Timestamp::from_microsecond(micros).unwrap_or(Timestamp::MAX)
    }
}

impl fmt::Display for ReportId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(formatter)
    }
}

impl FromStr for ReportId {
    type Err = ParseIntError;

    fn from_str(text: &str) -> Result<Self, ParseIntError> {
        text.parse().map(Self)
    }
}

/// A report to be stored.
#[derive(Debug, Clone)]
pub struct NewReport {
    /// The name under which it is stored.
    pub camera: String,
    /// The time at which its frame arrived.
    pub received_at: Timestamp,
    /// The number of persons in it.
    pub persons: usize,
    /// The scores of its persons and of boxes below the threshold, from
    /// [`lookdown_tracking::taught::LEAST_SCORE`] on. `None` if they are unknown: Redis has none.
    pub scores: Option<Vec<f32>>,
    /// The report as it was answered: one line of JSON.
    pub json: Bytes,
}

impl NewReport {
    /// The approximate memory that it takes when it is stored, bytes.
    pub fn bytes(&self) -> usize {
        let scores = self
            .scores
            .as_ref()
            .map_or(0, |scores| size_of_val(scores.as_slice()));
        size_of::<StoredReport>() + self.json.len() + self.camera.len() + scores
    }
}

/// A stored report. It never changes.
#[derive(Debug)]
pub struct StoredReport {
    /// Its position in the order of all reports.
    pub id: ReportId,
    /// The report.
    pub report: NewReport,
}

/// The cameras of a query.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Cameras {
    /// Every camera.
    All,
    /// This camera.
    One(String),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_increase_when_the_clock_stands_still_or_goes_back() {
        let now: Timestamp = "2026-11-21T09:30:00.123456Z".parse().unwrap();
        let first = ReportId::next(ReportId::default(), now);
        assert_eq!(first, ReportId::at(now));
        assert_eq!(first.time(), now);
        let second = ReportId::next(first, now);
        assert!(second > first);
        let earlier = now - jiff::SignedDuration::from_hours(1);
        assert!(ReportId::next(second, earlier) > second);
    }

    #[test]
    fn an_id_is_parsed_as_it_is_written() {
        let id = ReportId::at("2026-11-21T09:30:00Z".parse().unwrap());
        assert_eq!(id.to_string().parse(), Ok(id));
        for no_id in ["", "-1", "1.5", "99999999999999999999", "latest"] {
            assert!(no_id.parse::<ReportId>().is_err(), "{no_id}");
        }
        assert_eq!(ReportId(u64::MAX).time(), Timestamp::MAX);
    }
}

//! A report that is kept, and the ID that says where it stands among all of them.

use std::{fmt, num::ParseIntError, str::FromStr};

use bytes::Bytes;
use jiff::Timestamp;

/// Says which of two reports came later. It is the time at which its report was stored, in microseconds
/// since 1970, or one more than the ID before it when that was not earlier. So IDs also grow from one
/// start of the server to the next.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ReportId(u64);

impl ReportId {
    /// The ID after `last`, now.
    #[must_use]
    pub fn next(last: Self, now: Timestamp) -> Self {
        Self::at(now).max(Self(last.0.saturating_add(1)))
    }

    /// That of a report stored at this time; times before 1970 count as 1970.
    #[must_use]
    pub fn at(time: Timestamp) -> Self {
        Self(u64::try_from(time.as_microsecond()).unwrap_or(0))
    }

    /// When the report was stored, to the microsecond.
    #[must_use]
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

/// A report that is to be kept.
#[derive(Debug, Clone)]
pub struct NewReport {
    /// The name under which it is kept.
    pub camera: String,
    /// When its frame arrived.
    pub received_at: Timestamp,
    /// How many persons are in it.
    pub persons: usize,
    /// The report as it was answered: one line of JSON.
    pub json: Bytes,
}

impl NewReport {
    /// About how much memory it takes when it is kept, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of::<StoredReport>() + self.json.len() + self.camera.len()
    }
}

/// A report that is kept. It never changes.
#[derive(Debug)]
pub struct StoredReport {
    /// Where it stands among all reports.
    pub id: ReportId,
    /// What is kept.
    pub report: NewReport,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_is_the_time_unless_that_stands_still_or_goes_back() {
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
    fn an_id_is_read_as_it_is_written() {
        let id = ReportId::at("2026-11-21T09:30:00Z".parse().unwrap());
        assert_eq!(id.to_string().parse(), Ok(id));
        for no_id in ["", "-1", "1.5", "99999999999999999999", "latest"] {
            assert!(no_id.parse::<ReportId>().is_err(), "{no_id}");
        }
        assert_eq!(ReportId(u64::MAX).time(), Timestamp::MAX);
    }
}

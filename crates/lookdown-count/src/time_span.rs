//! A time from a first to a last moment.

use crate::sums::{MINUTE_MS, Period};

/// A time in milliseconds since the Unix epoch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct TimeSpan {
    pub(crate) from_ms: i64,
    /// The end, which is not part of it.
    pub(crate) to_ms: i64,
}

impl TimeSpan {
    /// Splits the time into its parts per minute: the minute and the milliseconds in it.
    pub(crate) fn minutes(self) -> impl Iterator<Item = (Period, u64)> {
        let first = self.from_ms.div_euclid(MINUTE_MS);
        let last = self.to_ms.div_euclid(MINUTE_MS);
        (first..=last).filter_map(move |minute| {
            let start = self.from_ms.max(minute * MINUTE_MS);
            let end = self.to_ms.min((minute + 1) * MINUTE_MS);
            let length = u64::try_from(end - start).ok()?;
            (length > 0).then_some((minute, length))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_split_at_the_minutes() {
        let minutes = |from_ms, to_ms| {
            let parts = TimeSpan { from_ms, to_ms }.minutes();
            parts.collect::<Vec<_>>()
        };
        let parts = minutes(59_000, 181_000);
        assert_eq!(parts, [(0, 1_000), (1, 60_000), (2, 60_000), (3, 1_000)]);
        assert_eq!(minutes(60_000, 120_000), [(1, 60_000)]);
        assert!(minutes(5, 5).is_empty());
    }
}

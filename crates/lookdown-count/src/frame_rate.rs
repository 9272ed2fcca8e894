//! The rate of the frames that became reports: lines miss crossings where it is too low.

use jiff::{Timestamp, tz::TimeZone};

use crate::time_span::TimeSpan;

/// Frames per second that lines need: fewer lose crossings and identities
/// (docs/lab/count-accuracy.md, "Rates").
const NEEDED_RATE: f64 = 2.5;
/// The rate is too low from the longer mean interval on, until the shorter one: a camera with just
/// [`NEEDED_RATE`], whose interval is 400 ms, is not marked, milliseconds.
const TOO_LONG_MS: f64 = 450.0;
const ENOUGH_MS: f64 = 420.0;
/// Time over which intervals are averaged: a slow second alone is not marked, milliseconds.
const AVERAGED_MS: f64 = 10_000.0;

/// The mean interval between the frames of a camera, by the times of its reports.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FrameRate {
    interval_ms: f64,
    /// Time since which the rate is too low, milliseconds since the Unix epoch.
    pub(crate) too_low_since_ms: Option<i64>,
}

impl FrameRate {
    /// Adds the time between two reports. Returns true if it had too few frames.
    pub(crate) fn add(&mut self, time: TimeSpan) -> bool {
        let interval_ms = (time.to_ms - time.from_ms) as f64;
        let weight = 1.0 - (-interval_ms / AVERAGED_MS).exp();
        self.interval_ms += weight * (interval_ms - self.interval_ms);
        let most_ms = match self.too_low_since_ms {
            None => TOO_LONG_MS,
            Some(_) => ENOUGH_MS,
        };
        let since_ms = self.too_low_since_ms.unwrap_or(time.from_ms);
        self.too_low_since_ms = (self.interval_ms > most_ms).then_some(since_ms);
        self.too_low_since_ms.is_some()
    }

    /// Returns the sentence about a rate that is too low, with the remedy.
    pub(crate) fn warning(&self) -> Option<String> {
        let since = Timestamp::from_millisecond(self.too_low_since_ms?).ok()?;
        let since = since
            .to_zoned(TimeZone::system())
            .strftime("%H:%M")
            .to_string();
        let rate = 1000.0 / self.interval_ms;
        Some(format!(
            "counts may be too low since {since}: {rate:.1} frames/s become reports, and lines need \
             {NEEDED_RATE}: choose a higher Rate (`every`) for the camera, or automatic"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lasting_low_rate_is_marked_from_its_beginning() {
        let mut rate = FrameRate::default();
        let mut at_ms = 0;
        let mut send = |seconds: i64, interval_ms: i64| {
            let ends_ms = at_ms + 1000 * seconds;
            let mut marked_ms = 0;
            while at_ms < ends_ms {
                let (from_ms, to_ms) = (at_ms, at_ms + interval_ms);
                let is_slow = rate.add(TimeSpan { from_ms, to_ms });
                marked_ms += if is_slow { interval_ms } else { 0 };
                at_ms = to_ms;
            }
            (marked_ms, rate)
        };
        for (seconds, interval_ms, marked_s) in [
            (60, 200, 0..=0),
            (1, 1000, 0..=0),
            (60, 400, 0..=0),
            (60, 500, 45..=58),
            (60, 400, 10..=20),
            (60, 200, 0..=5),
        ] {
            let (marked_ms, _) = send(seconds, interval_ms);
            let case = format!("{interval_ms}: {marked_ms}");
            assert!(marked_s.contains(&(marked_ms / 1000)), "{case}");
        }
        let (_, rate) = send(30, 1000);
        let warning = rate.warning().unwrap();
        assert!(
            warning.contains("1.0 frames/s") && warning.contains("`every`"),
            "{warning}"
        );
    }
}

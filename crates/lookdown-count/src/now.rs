//! The own clocks at one moment, and times in milliseconds.

use std::time::{Duration, Instant};

use jiff::Timestamp;

/// The clock of the machine, and one that never jumps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Now {
    /// Milliseconds since the Unix epoch. It may jump.
    pub(crate) unix_ms: i64,
    /// It measures durations.
    pub(crate) instant: Instant,
}

impl Now {
    /// Reads both clocks.
    pub(crate) fn read() -> Self {
        Self {
            unix_ms: Timestamp::now().as_millisecond(),
            instant: Instant::now(),
        }
    }
}

/// Returns the milliseconds of a time in seconds.
pub(crate) fn milliseconds(seconds: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "times of reports")]
    let milliseconds = (seconds * 1000.0).round() as i64;
    milliseconds
}

/// Returns the time of milliseconds since the Unix epoch, or the nearest one that can be written.
pub(crate) fn time_of(milliseconds: i64) -> Timestamp {
    let nearest = if milliseconds < 0 {
        Timestamp::MIN
    } else {
        Timestamp::MAX
    };
    Timestamp::from_millisecond(milliseconds).unwrap_or(nearest)
}

/// Keeps equal log lines apart.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LogPause(Option<Instant>);

impl LogPause {
    /// Returns true if there was no line for `pause`: then there is one now.
    pub(crate) fn is_over(&mut self, pause: Duration, now: Now) -> bool {
        let elapsed = self.0.map(|last| now.instant.duration_since(last));
        let is_over = elapsed.is_none_or(|elapsed| elapsed >= pause);
        if is_over {
            self.0 = Some(now.instant);
        }
        is_over
    }
}

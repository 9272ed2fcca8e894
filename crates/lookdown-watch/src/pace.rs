//! The times at which frames are sent.

use std::time::{Duration, Instant};

/// The part of the interval by which a frame may be sent early.
const TOLERANCE: u32 = 10;

/// Keeps the mean interval between two frames, although sources deliver them early or late.
#[derive(Debug)]
pub(crate) struct Pace {
    every: Duration,
    due: Option<Instant>,
}

impl Pace {
    pub(crate) fn new(every: Duration) -> Self {
        Self { every, due: None }
    }

    /// The earliest time for the next frame. `None` before the first frame.
    pub(crate) fn earliest(&self) -> Option<Instant> {
        self.due?.checked_sub(self.every / TOLERANCE)
    }

    /// Notes that a frame is being sent now.
    pub(crate) fn sent(&mut self, now: Instant) {
        let due = self.due.unwrap_or(now);
        // Time that was lost is not made up for.
        let is_late = now.saturating_duration_since(due) > self.every;
        self.due = Some(if is_late { now } else { due } + self.every);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVERY: Duration = Duration::from_secs(1);

    /// Sends the frames that arrive at these times in milliseconds, and returns the times of
    /// sending.
    fn sent(arrivals: impl Iterator<Item = u64>) -> Vec<u64> {
        let start = Instant::now();
        let mut pace = Pace::new(EVERY);
        let mut sent = Vec::new();
        for arrival in arrivals {
            let at = start + Duration::from_millis(arrival);
            if pace.earliest().is_none_or(|earliest| at >= earliest) {
                pace.sent(at);
                sent.push(arrival);
            }
        }
        sent
    }

    #[test]
    fn a_fast_source_is_sent_at_the_interval() {
        let sent = sent((0..100).map(|frame| frame * 40));
        assert_eq!(sent, [0, 920, 1920, 2920, 3920]);
    }

    #[test]
    fn jitter_of_a_source_costs_no_frame() {
        let jitter = [0, 30, 0, 60, 10, 0, 80, 20];
        let arrivals = jitter.iter().zip(0..).map(|(jitter, k)| k * 1000 + jitter);
        assert_eq!(sent(arrivals).len(), jitter.len());
    }

    #[test]
    fn lost_time_is_not_made_up_for() {
        let sent = sent([0, 1000, 7500].into_iter().chain((8..11).map(|s| s * 1000)));
        assert_eq!(sent, [0, 1000, 7500, 9000, 10_000]);
    }
}

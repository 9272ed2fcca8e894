//! Exponential backoff with jitter, bounded.

use std::time::Duration;

/// The time after which a connection counts as stable, and the backoff starts again.
const STABLE: Duration = Duration::from_secs(3);

/// The pauses between attempts. Each is a random time between half of the current limit and the
/// limit, which doubles with every attempt.
#[derive(Debug, Clone)]
pub struct Backoff {
    first: Duration,
    longest: Duration,
    attempts: u32,
}

impl Backoff {
    /// Creates a backoff from the first to the longest pause.
    pub fn new(first: Duration, longest: Duration) -> Self {
        Self {
            first,
            longest,
            attempts: 0,
        }
    }

    /// Returns the next pause.
    pub fn next_pause(&mut self) -> Duration {
        let limit = self.first.saturating_mul(1 << self.attempts.min(20));
        self.attempts = self.attempts.saturating_add(1);
        jittered(limit.min(self.longest))
    }

    /// Starts again with the first pause.
    pub fn reset(&mut self) {
        self.attempts = 0;
    }

    /// Starts again with the first pause if the connection lived long enough.
    pub fn reset_if_stable(&mut self, lifetime: Duration) {
        if lifetime >= STABLE {
            self.reset();
        }
    }
}

/// Returns a random duration from half of the limit to the limit.
fn jittered(limit: Duration) -> Duration {
    // Without random numbers there is no jitter, and the pause is still bounded.
    let random = getrandom::u32().unwrap_or(u32::MAX);
    limit.mul_f64(0.5 + f64::from(random) / f64::from(u32::MAX) / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIRST: Duration = Duration::from_millis(500);
    const LONGEST: Duration = Duration::from_secs(30);

    #[test]
    fn pauses_double_up_to_the_longest() {
        let mut backoff = Backoff::new(FIRST, LONGEST);
        for attempt in 0..40_u32 {
            let limit = FIRST.saturating_mul(1 << attempt.min(10)).min(LONGEST);
            let pause = backoff.next_pause();
            assert!(pause <= limit && pause >= limit / 2, "{attempt}: {pause:?}");
        }
    }

    #[test]
    fn pauses_are_random() {
        let pauses: Vec<_> = (0..8)
            .map(|_| Backoff::new(FIRST, LONGEST).next_pause())
            .collect();
        assert!(pauses.windows(2).any(|pair| pair[0] != pair[1]));
    }

    #[test]
    fn only_a_stable_connection_resets_the_backoff() {
        let mut backoff = Backoff::new(FIRST, LONGEST);
        for _ in 0..10 {
            backoff.next_pause();
            backoff.reset_if_stable(Duration::from_secs(1));
        }
        assert!(backoff.next_pause() > FIRST);
        backoff.reset_if_stable(STABLE);
        assert!(backoff.next_pause() <= FIRST);
    }
}

//! A circuit breaker for requests to a server.
//!
//! It opens after a few failures in a row, so that no request waits for an unavailable server. The
//! health check closes it when the server is ready again. The next failure then reopens it at once,
//! and a response resets it completely.

use parking_lot::{Mutex, MutexGuard};

/// Consecutive failures that open it.
const FAILURES: u32 = 3;

/// Circuit breaker state, shared by all sessions.
#[derive(Debug, Default)]
pub(super) struct Breaker(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    failures: u32,
    is_open: bool,
}

impl Breaker {
    pub(super) fn is_open(&self) -> bool {
        self.state().is_open
    }

    /// Records a response.
    pub(super) fn succeeded(&self) {
        self.state().failures = 0;
    }

    /// Records a failure. Returns true if that opens the breaker.
    pub(super) fn failed(&self) -> bool {
        let mut state = self.state();
        state.failures = state.failures.saturating_add(1);
        let opens = !state.is_open && state.failures >= FAILURES;
        state.is_open |= opens;
        opens
    }

    /// Records that the server is ready. Returns true if that closes the breaker.
    pub(super) fn close(&self) -> bool {
        let mut state = self.state();
        let closes = state.is_open;
        if closes {
            state.is_open = false;
            state.failures = FAILURES - 1;
        }
        closes
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // The state contains only numbers, so a panic cannot leave it inconsistent.
        self.0.lock()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consecutive_failures_open_it_and_a_response_resets_it() {
        let breaker = Breaker::default();
        for _ in 0..2 {
            assert!(!breaker.failed());
        }
        breaker.succeeded();
        let opened: Vec<_> = (0..4).map(|_| breaker.failed()).collect();
        assert_eq!(opened, [false, false, true, false], "it opens once");
        assert!(breaker.is_open());
    }

    #[test]
    fn one_failure_reopens_it_until_a_response_arrives() {
        let breaker = Breaker::default();
        while !breaker.failed() {}
        assert!(breaker.close() && !breaker.close() && !breaker.is_open());
        assert!(breaker.failed(), "one more failure opens it");
        assert!(breaker.close());
        breaker.succeeded();
        assert!(!breaker.failed() && !breaker.is_open());
    }
}

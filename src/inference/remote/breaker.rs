//! A circuit breaker: whether a server is asked at all.
//!
//! After a few failures in a row it opens, and nobody has to wait for what fails. Whoever looks after the
//! server closes it when it answers again; the next failure opens it at once then, and an answer makes it
//! as good as new.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Failures in a row that open it.
const FAILURES: u32 = 3;

/// Whether a server is asked at all.
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

    /// An answer came.
    pub(super) fn succeeded(&self) {
        self.state().failures = 0;
    }

    /// None came; returns whether that opens it.
    pub(super) fn failed(&self) -> bool {
        let mut state = self.state();
        state.failures = state.failures.saturating_add(1);
        let opens = !state.is_open && state.failures >= FAILURES;
        state.is_open |= opens;
        opens
    }

    /// The server says that it is there; returns whether that closes it.
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
        // Numbers only: nothing can be left half changed.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_in_a_row_open_it_and_an_answer_between_them_counts() {
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
    fn a_closed_one_is_on_probation_until_an_answer_comes() {
        let breaker = Breaker::default();
        while !breaker.failed() {}
        assert!(breaker.close() && !breaker.close() && !breaker.is_open());
        assert!(breaker.failed(), "one more failure opens it");
        assert!(breaker.close());
        breaker.succeeded();
        assert!(!breaker.failed() && !breaker.is_open());
    }
}

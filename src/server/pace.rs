//! Who keeps a connection waiting, and until when it may.

use std::{
    sync::{Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use tokio::time::{Instant, sleep_until};

use super::ConnectionLimits;

/// What a connection waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// For the head of its first request.
    FirstHead,
    /// For the rest of a later request's head.
    Head,
    /// For the next request.
    Idle,
    /// For the service, which has deadlines of its own.
    Service,
}

#[derive(Debug)]
struct State {
    phase: Phase,
    /// When the phase has taken too long.
    until: Option<Instant>,
    /// When the client, which does not take what it is sent, has done so for too long.
    blocked_until: Option<Instant>,
}

/// Follows a connection, and notices when its client takes too long.
#[derive(Debug)]
pub(super) struct Pace {
    state: Mutex<State>,
    header_timeout: Duration,
    idle_timeout: Duration,
}

impl Pace {
    /// A connection that has just been accepted.
    pub(super) fn new(limits: &ConnectionLimits) -> Self {
        let state = State {
            phase: Phase::FirstHead,
            until: Some(Instant::now() + limits.header_timeout),
            blocked_until: None,
        };
        Self {
            state: Mutex::new(state),
            header_timeout: limits.header_timeout,
            idle_timeout: limits.idle_timeout,
        }
    }

    /// Bytes have come.
    pub(super) fn received(&self) {
        let mut state = self.state();
        if state.phase == Phase::Idle {
            state.phase = Phase::Head;
            state.until = Some(Instant::now() + self.header_timeout);
        }
    }

    /// The head of a request is complete.
    pub(super) fn request_begins(&self) {
        let mut state = self.state();
        state.phase = Phase::Service;
        state.until = None;
    }

    /// The last byte of an answer is on its way.
    pub(super) fn request_ends(&self) {
        let mut state = self.state();
        state.phase = Phase::Idle;
        state.until = Some(Instant::now() + self.idle_timeout);
    }

    /// The client takes, or does not take, what it is sent.
    pub(super) fn sending(&self, is_blocked: bool) {
        let mut state = self.state();
        if is_blocked != state.blocked_until.is_some() {
            state.blocked_until = is_blocked.then(|| Instant::now() + self.idle_timeout);
        }
    }

    /// Whether there was no request yet.
    pub(super) fn awaits_first_request(&self) -> bool {
        self.state().phase == Phase::FirstHead
    }

    /// Waits until the client has taken too long.
    ///
    /// Looks now and then, so that requests need not wake it: what is set between two looks is no earlier
    /// than the second, because they are no further apart than the shortest timeout.
    pub(super) async fn overdue(&self) {
        loop {
            let now = Instant::now();
            let next_look = now + self.header_timeout.min(self.idle_timeout);
            let deadline = self.state().deadline();
            if deadline.is_some_and(|deadline| deadline <= now) {
                return;
            }
            sleep_until(deadline.map_or(next_look, |deadline| deadline.min(next_look))).await;
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // No change can panic half-way.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn deadline(&self) -> Option<Instant> {
        [self.until, self.blocked_until].into_iter().flatten().min()
    }
}

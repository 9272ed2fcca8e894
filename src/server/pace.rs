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

    /// All of an answer is ready to be sent.
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
        // The body of an answer may be given up long before its last byte is taken.
        if !is_blocked && state.phase == Phase::Idle {
            state.until = Some(Instant::now() + self.idle_timeout);
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

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use tokio::time::{advance, timeout};

    use super::*;

    const IDLE: Duration = Duration::from_secs(4);

    fn pace() -> Pace {
        Pace::new(&ConnectionLimits {
            max_connections: NonZeroUsize::MIN,
            header_timeout: Duration::from_secs(1),
            idle_timeout: IDLE,
            max_header_bytes: 1024,
            max_headers: 10,
        })
    }

    async fn is_overdue(pace: &Pace) -> bool {
        timeout(Duration::from_millis(1), pace.overdue())
            .await
            .is_ok()
    }

    #[tokio::test(start_paused = true)]
    async fn a_client_that_goes_on_taking_its_answer_slowly_may_finish() {
        let pace = pace();
        pace.request_begins();
        pace.request_ends();
        for _ in 0..5 {
            pace.sending(true);
            advance(IDLE / 2).await;
            pace.sending(false);
            assert!(!is_overdue(&pace).await);
        }
        pace.sending(true);
        advance(IDLE).await;
        assert!(is_overdue(&pace).await);
    }

    #[tokio::test(start_paused = true)]
    async fn a_deadline_that_is_set_while_somebody_waits_is_kept_to() {
        let pace = pace();
        pace.request_begins();
        pace.request_ends();
        let began = Instant::now();
        let head = async {
            tokio::time::sleep(IDLE / 3).await;
            pace.received();
        };
        tokio::join!(pace.overdue(), head);
        let since_received = began.elapsed().saturating_sub(IDLE / 3);
        assert_eq!(since_received.as_secs(), 1);
    }
}

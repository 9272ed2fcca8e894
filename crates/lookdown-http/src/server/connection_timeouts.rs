//! The timeouts of a connection.

use std::time::Duration;

use parking_lot::Mutex;
use tokio::time::{Instant, sleep_until};

use super::ConnectionLimits;

/// The phase of a connection: the event that it waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The head of its first request.
    FirstHead,
    /// The rest of a later request's head.
    Head,
    /// The next request.
    Idle,
    /// The service, which has its own deadlines.
    Service,
}

#[derive(Debug)]
struct State {
    phase: Phase,
    /// The time at which the phase times out.
    until: Option<Instant>,
    reading: Reading,
}

/// The progress of a client that reads responses.
#[derive(Debug, Default)]
struct Reading {
    /// The time since which the client blocks the response.
    blocked_since: Option<Instant>,
    /// The time for which it blocked the response since it last read [`PROGRESS_BYTES`], without
    /// the current wait.
    blocked: Duration,
    /// The bytes that were sent since then.
    sent_bytes: usize,
}

/// A client that blocks a response must read as many bytes within the idle timeout, so that it
/// cannot hold a response in memory by reading a few bytes at a time.
const PROGRESS_BYTES: usize = 64 << 10;

impl Reading {
    fn sent(&mut self, bytes: usize) {
        if let Some(since) = self.blocked_since.take() {
            self.blocked += since.elapsed();
        }
        self.sent_bytes = self.sent_bytes.saturating_add(bytes);
        if self.sent_bytes >= PROGRESS_BYTES {
            *self = Self::default();
        }
    }

    fn deadline(&self, timeout: Duration) -> Option<Instant> {
        Some(self.blocked_since? + timeout.saturating_sub(self.blocked))
    }
}

/// Tracks the phases of a connection and detects timeouts.
#[derive(Debug)]
pub(super) struct ConnectionTimeouts {
    // No change can panic before it is complete.
    state: Mutex<State>,
    header_timeout: Duration,
    idle_timeout: Duration,
}

impl ConnectionTimeouts {
    /// Starts with a connection that has just been accepted.
    pub(super) fn new(limits: &ConnectionLimits) -> Self {
        let state = State {
            phase: Phase::FirstHead,
            until: Some(Instant::now() + limits.header_timeout),
            reading: Reading::default(),
        };
        Self {
            state: Mutex::new(state),
            header_timeout: limits.header_timeout,
            idle_timeout: limits.idle_timeout,
        }
    }

    /// Records that bytes have arrived.
    pub(super) fn received(&self) {
        let mut state = self.state.lock();
        if state.phase == Phase::Idle {
            state.phase = Phase::Head;
            state.until = Some(Instant::now() + self.header_timeout);
        }
    }

    /// Records that the head of a request is complete.
    pub(super) fn request_begins(&self) {
        let mut state = self.state.lock();
        state.phase = Phase::Service;
        state.until = None;
    }

    /// Records that all of a response is ready to be sent. A head that arrived in part with the
    /// last request has the time of an idle connection.
    pub(super) fn request_ends(&self) {
        let mut state = self.state.lock();
        state.phase = Phase::Idle;
        state.until = Some(Instant::now() + self.idle_timeout);
    }

    /// Records that the client blocks the response.
    pub(super) fn blocked(&self) {
        self.state
            .lock()
            .reading
            .blocked_since
            .get_or_insert_with(Instant::now);
    }

    /// Records sent bytes.
    pub(super) fn sent(&self, bytes: usize) {
        let mut state = self.state.lock();
        state.reading.sent(bytes);
        // The body of a response may be dropped long before its last byte is read.
        if state.phase == Phase::Idle {
            state.until = Some(Instant::now() + self.idle_timeout);
        }
    }

    /// Returns true if no request has arrived yet.
    pub(super) fn awaits_first_request(&self) -> bool {
        self.state.lock().phase == Phase::FirstHead
    }

    /// Waits for a timeout.
    ///
    /// It polls, so that requests need not wake it. The polls are no further apart than the
    /// shortest timeout, so a deadline that is set between two polls is not before the second.
    pub(super) async fn overdue(&self) {
        loop {
            let now = Instant::now();
            let next_look = now + self.header_timeout.min(self.idle_timeout);
            let deadline = self.state.lock().deadline(self.idle_timeout);
            if deadline.is_some_and(|deadline| deadline <= now) {
                return;
            }
            sleep_until(deadline.map_or(next_look, |deadline| deadline.min(next_look))).await;
        }
    }
}

impl State {
    fn deadline(&self, idle_timeout: Duration) -> Option<Instant> {
        let reading = self.reading.deadline(idle_timeout);
        [self.until, reading].into_iter().flatten().min()
    }
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroUsize;

    use tokio::time::{advance, timeout};

    use super::*;

    const IDLE: Duration = Duration::from_secs(4);

    fn pace() -> ConnectionTimeouts {
        ConnectionTimeouts::new(&ConnectionLimits {
            max_connections: NonZeroUsize::MIN,
            header_timeout: Duration::from_secs(1),
            idle_timeout: IDLE,
            max_header_bytes: 1024,
            max_headers: 10,
        })
    }

    async fn is_overdue(timeouts: &ConnectionTimeouts) -> bool {
        timeout(Duration::from_millis(1), timeouts.overdue())
            .await
            .is_ok()
    }

    #[tokio::test(start_paused = true)]
    async fn a_client_that_reads_slowly_but_steadily_may_finish() {
        let timeouts = pace();
        timeouts.request_begins();
        timeouts.request_ends();
        for _ in 0..5 {
            timeouts.blocked();
            advance(IDLE / 2).await;
            timeouts.sent(PROGRESS_BYTES);
            assert!(!is_overdue(&timeouts).await);
        }
        timeouts.blocked();
        advance(IDLE).await;
        assert!(is_overdue(&timeouts).await);
    }

    #[tokio::test(start_paused = true)]
    async fn a_client_that_reads_a_few_bytes_at_a_time_is_overdue() {
        let timeouts = pace();
        timeouts.request_begins();
        timeouts.request_ends();
        let began = Instant::now();
        while !is_overdue(&timeouts).await && began.elapsed() < 2 * IDLE {
            timeouts.blocked();
            advance(IDLE / 8).await;
            timeouts.sent(1);
            timeouts.blocked();
        }
        assert_eq!(began.elapsed().as_secs(), IDLE.as_secs());
    }

    #[tokio::test(start_paused = true)]
    async fn a_deadline_set_during_the_wait_is_kept() {
        let timeouts = pace();
        timeouts.request_begins();
        timeouts.request_ends();
        let began = Instant::now();
        let head = async {
            tokio::time::sleep(IDLE / 3).await;
            timeouts.received();
        };
        tokio::join!(timeouts.overdue(), head);
        let since_received = began.elapsed().saturating_sub(IDLE / 3);
        assert_eq!(since_received.as_secs(), 1);
    }
}

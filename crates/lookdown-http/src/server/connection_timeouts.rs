//! The timeouts of a connection.

use std::time::Duration;

use parking_lot::{Mutex, MutexGuard};
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
    request: RequestBytes,
}

/// The progress of a client that reads responses.
#[derive(Debug, Default)]
struct Reading {
    /// The time since which the client blocks the response.
    blocked_since: Option<Instant>,
    /// The time for which it blocked the response since it last read [`PROGRESS_BYTES`], without the
    /// current wait.
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

/// The bytes of the current request, counted to find bytes of the next one that arrived with it.
#[derive(Debug, Default)]
struct RequestBytes {
    /// The last bytes that arrived, at most as many as [`HEAD_END`] has.
    tail: Vec<u8>,
    /// The bytes after the head, once the head is complete.
    after_head: Option<u64>,
    /// The length of the body; `None` for a body that states its end itself.
    body: Option<u64>,
}

/// The end of a head, and of a body in chunks.
const HEAD_END: &[u8] = b"\r\n\r\n";

impl RequestBytes {
    fn add(&mut self, bytes: &[u8]) {
        self.tail.extend_from_slice(bytes);
        if let Some(count) = &mut self.after_head {
            *count += bytes.len() as u64;
        } else {
            let mut parts = self.tail.windows(HEAD_END.len());
            let end = parts.position(|part| part == HEAD_END);
            self.after_head = end.map(|at| (self.tail.len() - at - HEAD_END.len()) as u64);
        }
        self.tail
            .drain(..self.tail.len().saturating_sub(HEAD_END.len()));
    }

    /// Returns true if bytes of the next request have arrived.
    fn hold_the_next(&self) -> bool {
        match (self.body, self.after_head) {
            (Some(length), Some(after_head)) => after_head > length,
            (None, _) => self.tail != HEAD_END,
            (Some(_), None) => false,
        }
    }
}

/// Tracks the phases of a connection and detects timeouts.
#[derive(Debug)]
pub(super) struct ConnectionTimeouts {
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
            request: RequestBytes::default(),
        };
        Self {
            state: Mutex::new(state),
            header_timeout: limits.header_timeout,
            idle_timeout: limits.idle_timeout,
        }
    }

    /// Records received bytes.
    pub(super) fn received(&self, bytes: &[u8]) {
        let mut state = self.state();
        state.request.add(bytes);
        if state.phase == Phase::Idle {
            state.phase = Phase::Head;
            state.until = Some(Instant::now() + self.header_timeout);
        }
    }

    /// Records that the head of a request is complete. `body` is the length of its body, if the head
    /// states it.
    pub(super) fn request_begins(&self, body: Option<u64>) {
        let mut state = self.state();
        state.request.body = body;
        state.phase = Phase::Service;
        state.until = None;
    }

    /// Records that all of a response is ready to be sent.
    pub(super) fn request_ends(&self) {
        let mut state = self.state();
        let (phase, time) = if std::mem::take(&mut state.request).hold_the_next() {
            (Phase::Head, self.header_timeout)
        } else {
            (Phase::Idle, self.idle_timeout)
        };
        state.phase = phase;
        state.until = Some(Instant::now() + time);
    }

    /// Records that the client blocks the response.
    pub(super) fn blocked(&self) {
        self.state()
            .reading
            .blocked_since
            .get_or_insert_with(Instant::now);
    }

    /// Records sent bytes.
    pub(super) fn sent(&self, bytes: usize) {
        let mut state = self.state();
        state.reading.sent(bytes);
        // The body of a response may be dropped long before its last byte is read.
        if state.phase == Phase::Idle {
            state.until = Some(Instant::now() + self.idle_timeout);
        }
    }

    /// Returns true if no request has arrived yet.
    pub(super) fn awaits_first_request(&self) -> bool {
        self.state().phase == Phase::FirstHead
    }

    /// Waits for a timeout.
    ///
    /// It polls, so that requests need not wake it. The polls are no further apart than the
    /// shortest timeout, so a deadline that is set between two polls is not before the second.
    pub(super) async fn overdue(&self) {
        loop {
            let now = Instant::now();
            let next_look = now + self.header_timeout.min(self.idle_timeout);
            let deadline = self.state().deadline(self.idle_timeout);
            if deadline.is_some_and(|deadline| deadline <= now) {
                return;
            }
            sleep_until(deadline.map_or(next_look, |deadline| deadline.min(next_look))).await;
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // No change can panic before it is complete.
        self.state.lock()
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
        timeouts.request_begins(Some(0));
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
        timeouts.request_begins(Some(0));
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
    async fn a_head_that_came_with_the_last_request_must_end_soon() {
        let body = b"POST / HTTP/1.1\r\n\r\nbody";
        let chunks = b"POST / HTTP/1.1\r\n\r\n4\r\nbody\r\n0\r\n\r\n";
        for (request, length) in [
            (&b"GET / HTTP/1.1\r\n\r\n"[..], Some(0)),
            (body, Some(4)),
            (chunks, None),
        ] {
            for (more, limit) in [(&b""[..], IDLE), (b"GET /", Duration::from_secs(1))] {
                for size in [1, 7, 1000] {
                    let timeouts = pace();
                    for part in [request, more].concat().chunks(size) {
                        timeouts.received(part);
                    }
                    timeouts.request_begins(length);
                    timeouts.request_ends();
                    let began = Instant::now();
                    timeouts.overdue().await;
                    assert_eq!(
                        began.elapsed().as_secs(),
                        limit.as_secs(),
                        "{more:?} {size}"
                    );
                }
            }
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_deadline_set_during_the_wait_is_kept() {
        let timeouts = pace();
        timeouts.request_begins(Some(0));
        timeouts.request_ends();
        let began = Instant::now();
        let head = async {
            tokio::time::sleep(IDLE / 3).await;
            timeouts.received(b"G");
        };
        tokio::join!(timeouts.overdue(), head);
        let since_received = began.elapsed().saturating_sub(IDLE / 3);
        assert_eq!(since_received.as_secs(), 1);
    }
}

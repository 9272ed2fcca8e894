//! An inference server, shared by all sessions and the health check.
//!
//! A circuit breaker for requests to a server.
//!
//! It opens after a few failures in a row, so that no request waits for an unavailable server. The
//! health check closes it when the server is ready again. The next failure then reopens it at once,
//! and a response resets it completely.

use std::{
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use parking_lot::Mutex;

use super::{
    connection::{Connection, RemoteOptions, Reply},
    exchange::{Output, Question},
};
use crate::{
    inference::InferenceError,
    metrics::{DetectMetrics, start_at_zero},
};

/// Timeout of the readiness probe.
const PROBE_TIMEOUT: Duration = Duration::from_secs(2);
/// A response within this time makes a readiness probe unnecessary.
const RECENT: Duration = Duration::from_secs(2);
/// Default retry time for responses of a busy server without `Retry-After`.
const RETRY_AFTER: Duration = Duration::from_secs(1);
/// Most characters of the server's error message that are reported.
const MAX_MESSAGE_CHARS: usize = 300;

/// The results of requests: a valid response, a refusal of a busy server, no valid response, and
/// none sent because the breaker was open.
const RESULTS: [&str; 4] = ["answered", "busy", "failed", "not_sent"];

/// An inference server. Its methods block and must not run on the async runtime.
pub struct RemoteServer {
    connection: Connection,
    options: RemoteOptions,
    breaker: Breaker,
    in_flight: AtomicUsize,
    answered_at: Mutex<Option<Instant>>,
    metrics: Arc<DetectMetrics>,
}

impl RemoteServer {
    /// Creates the client for the configured server. Sends nothing.
    ///
    /// # Errors
    /// [`InferenceError::Remote`] when the system's certificates cannot be used.
    pub fn new(
        options: RemoteOptions,
        metrics: Arc<DetectMetrics>,
    ) -> Result<Self, InferenceError> {
        let connection = Connection::new(&options);
        let connection = connection.map_err(|error| InferenceError::Remote {
            url: options.url.to_string(),
            detail: error.to_string(),
        })?;
        start_at_zero(&metrics.remote_requests, &RESULTS);
        let server = Self {
            connection,
            options,
            breaker: Breaker::default(),
            in_flight: AtomicUsize::new(0),
            answered_at: Mutex::default(),
            metrics,
        };
        server.publish_availability();
        Ok(server)
    }

    /// Returns true if requests are sent to the server, that is, the breaker is closed.
    pub fn is_available(&self) -> bool {
        !self.breaker.is_open()
    }

    /// Probes the server's readiness, unless recent responses make that unnecessary. Returns true
    /// if requests are sent to it from now on. A periodic call, about every second, lets the server
    /// recover automatically.
    pub fn check_health(&self) -> bool {
        if !(self.is_available() && self.responded_recently()) {
            match self.ready() {
                Ok(()) => {
                    if self.breaker.close() {
                        let url = &self.connection.address;
                        tracing::info!(%url, "the inference server is available again");
                    }
                }
                Err(detail) => self.note_failure(&detail),
            }
        }
        // Each time, so that a concurrent failure cannot leave an outdated value.
        self.publish_availability();
        self.is_available()
    }

    /// The server's name for the model with this name in its manifest.
    pub(super) fn name_of<'a>(&'a self, name: &'a str) -> &'a str {
        if name == self.options.called {
            &self.options.model
        } else {
            name
        }
    }

    /// Sends a GET request to a path.
    pub(super) fn get(&self, path: &[&str]) -> Result<Reply, InferenceError> {
        let reply = self.connection.get(path, self.options.timeout);
        reply.map_err(|detail| self.unavailable(detail))
    }

    /// Sends an inference request. 429 means that the server is busy, and so does 503 if the server
    /// reports that it is ready.
    pub(super) fn infer(
        &self,
        model: &str,
        question: &Question<'_>,
    ) -> Result<Vec<Output>, InferenceError> {
        if self.breaker.is_open() {
            self.count("not_sent");
            return Err(self.unavailable(
                "it failed repeatedly, so no requests are sent until it is ready".to_owned(),
            ));
        }
        let message = question
            .message()
            .map_err(|error| InferenceError::Run(error.to_string()))?;
        let path = ["v2", "models", model, "infer"];
        self.in_flight.fetch_add(1, Ordering::Relaxed);
        let reply = self
            .connection
            .post(&path, &message.body, message.head_length);
        self.in_flight.fetch_sub(1, Ordering::Relaxed);
        let wait = |reply: &Reply| reply.retry_after.unwrap_or(RETRY_AFTER);
        let answer = reply.and_then(|reply| match reply.status {
            200 => Output::all(&reply.into_message()).map(Ok),
            429 => Ok(Err(wait(&reply))),
            503 if self.ready().is_ok() => Ok(Err(wait(&reply))),
            _ => Err(refusal(&reply)),
        });
        if answer.is_ok() {
            self.breaker.succeeded();
            *self.answered_at.lock() = Some(Instant::now());
        }
        match answer {
            Ok(Ok(answer)) => {
                self.count("answered");
                Ok(answer)
            }
            Ok(Err(retry_after)) => {
                self.count("busy");
                Err(InferenceError::RemoteBusy { retry_after })
            }
            Err(detail) => {
                self.count("failed");
                self.note_failure(&detail);
                Err(self.unavailable(detail))
            }
        }
    }

    fn ready(&self) -> Result<(), String> {
        let path = ["v2", "models", &self.options.model, "ready"];
        let reply = self.connection.get(&path, PROBE_TIMEOUT)?;
        match reply.status {
            200 => Ok(()),
            _ => Err(refusal(&reply)),
        }
    }

    /// Returns true if a request is in flight or was answered recently. A computing server may have
    /// no time for a readiness probe.
    fn responded_recently(&self) -> bool {
        let answered_at = self.answered_at.lock();
        let recently = answered_at.is_some_and(|at| at.elapsed() < RECENT);
        recently || self.in_flight.load(Ordering::Relaxed) > 0
    }

    fn count(&self, result: &str) {
        let requests = &self.metrics.remote_requests;
        requests.with_label_values(&[result]).inc();
    }

    /// The number of requests with this result since the start.
    #[cfg(test)]
    pub(super) fn count_of(&self, result: &str) -> u64 {
        let requests = &self.metrics.remote_requests;
        requests.with_label_values(&[result]).get()
    }

    fn publish_availability(&self) {
        let no_labels: &[&str] = &[];
        let up = self.metrics.remote_up.with_label_values(no_labels);
        up.set(i64::from(self.is_available()));
    }

    fn note_failure(&self, detail: &str) {
        if self.breaker.failed() {
            self.publish_availability();
            let url = &self.connection.address;
            tracing::warn!(%url, "the inference server is unavailable: {detail}");
        }
    }

    pub(super) fn denied(&self, detail: String) -> InferenceError {
        InferenceError::RemoteDenied {
            url: self.connection.address.to_string(),
            detail,
        }
    }

    pub(super) fn unavailable(&self, detail: String) -> InferenceError {
        InferenceError::Remote {
            url: self.connection.address.to_string(),
            detail,
        }
    }
}

/// Formats an error status with the server's message.
pub(super) fn refusal(reply: &Reply) -> String {
    let status = reply.status;
    let message = String::from_utf8_lossy(&reply.body);
    let message: String = message
        .chars()
        .filter(|c| !c.is_control())
        .take(MAX_MESSAGE_CHARS)
        .collect();
    format!("it answered {status}: {message}")
}

/// Consecutive failures that open it.
const FAILURES: u32 = 3;

/// Circuit breaker state, shared by all sessions.
#[derive(Debug, Default)]
struct Breaker(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    failures: u32,
    is_open: bool,
}

impl Breaker {
    fn is_open(&self) -> bool {
        self.0.lock().is_open
    }

    /// Records a response.
    fn succeeded(&self) {
        self.0.lock().failures = 0;
    }

    /// Records a failure. Returns true if that opens the breaker.
    fn failed(&self) -> bool {
        let mut state = self.0.lock();
        state.failures = state.failures.saturating_add(1);
        let opens = !state.is_open && state.failures >= FAILURES;
        state.is_open |= opens;
        opens
    }

    /// Records that the server is ready. Returns true if that closes the breaker.
    fn close(&self) -> bool {
        let mut state = self.0.lock();
        let closes = state.is_open;
        if closes {
            state.is_open = false;
            state.failures = FAILURES - 1;
        }
        closes
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

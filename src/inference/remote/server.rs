//! An inference server, shared by all sessions and the health check.

use std::{
    sync::atomic::{AtomicU64, AtomicUsize, Ordering},
    time::{Duration, Instant},
};

use parking_lot::Mutex;

use super::{
    breaker::Breaker,
    connection::{Connection, Reply},
    exchange::{Answer, Question},
    options::RemoteOptions,
};
use crate::inference::InferenceError;

/// Timeout of the readiness probe.
const PROBE_TIMEOUT: Duration = Duration::from_secs(2);
/// A response within this time makes a readiness probe unnecessary.
const RECENT: Duration = Duration::from_secs(2);
/// Default retry time for responses of a busy server without `Retry-After`.
const RETRY_AFTER: Duration = Duration::from_secs(1);
/// Most characters of the server's error message that are reported.
const MAX_MESSAGE_CHARS: usize = 300;

/// Numbers of inference requests by result since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RemoteCounts {
    /// Requests with a valid response.
    pub answered: u64,
    /// Requests refused by a busy server.
    pub busy: u64,
    /// Requests without a valid response.
    pub failed: u64,
    /// Requests that were not sent because the breaker was open.
    pub not_sent: u64,
}

/// An inference server. Its methods block and must not run on the async runtime.
pub struct RemoteServer {
    connection: Connection,
    options: RemoteOptions,
    breaker: Breaker,
    in_flight: AtomicUsize,
    answered_at: Mutex<Option<Instant>>,
    answered: AtomicU64,
    busy: AtomicU64,
    failed: AtomicU64,
    not_sent: AtomicU64,
}

impl RemoteServer {
    /// Creates the client for the configured server. Sends nothing.
    ///
    /// # Errors
    /// [`InferenceError::Remote`] when the system's certificates cannot be used.
    pub fn new(options: RemoteOptions) -> Result<Self, InferenceError> {
        let connection = Connection::new(&options);
        let connection = connection.map_err(|error| InferenceError::Remote {
            url: options.url.to_string(),
            detail: error.to_string(),
        })?;
        Ok(Self {
            connection,
            options,
            breaker: Breaker::default(),
            in_flight: AtomicUsize::new(0),
            answered_at: Mutex::default(),
            answered: AtomicU64::new(0),
            busy: AtomicU64::new(0),
            failed: AtomicU64::new(0),
            not_sent: AtomicU64::new(0),
        })
    }

    /// Returns true if requests are sent to the server, that is, the breaker is closed.
    #[must_use]
    pub fn is_available(&self) -> bool {
        !self.breaker.is_open()
    }

    /// Numbers of inference requests by result.
    #[must_use]
    pub fn counts(&self) -> RemoteCounts {
        let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        RemoteCounts {
            answered: count(&self.answered),
            busy: count(&self.busy),
            failed: count(&self.failed),
            not_sent: count(&self.not_sent),
        }
    }

    /// Probes the server's readiness, unless recent responses make that unnecessary. Returns true
    /// if requests are sent to it from now on. A periodic call, about every second, lets the server
    /// recover automatically.
    pub fn check_health(&self) -> bool {
        if self.is_available() && self.responded_recently() {
            return true;
        }
        match self.ready() {
            Ok(()) => {
                if self.breaker.close() {
                    let url = self.connection.address();
                    tracing::info!(%url, "the inference server is available again");
                }
            }
            Err(detail) => self.note_failure(&detail),
        }
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
        let reply = self.connection.get(path, self.options.patience);
        reply.map_err(|detail| self.unavailable(detail))
    }

    /// Sends an inference request. 429 means that the server is busy, and so does 503 if the server
    /// reports that it is ready.
    pub(super) fn infer(
        &self,
        model: &str,
        question: &Question<'_>,
    ) -> Result<Answer, InferenceError> {
        if self.breaker.is_open() {
            self.not_sent.fetch_add(1, Ordering::Relaxed);
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
            200 => Answer::read(&reply.into_message()).map(Ok),
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
                self.answered.fetch_add(1, Ordering::Relaxed);
                Ok(answer)
            }
            Ok(Err(retry_after)) => {
                self.busy.fetch_add(1, Ordering::Relaxed);
                Err(InferenceError::RemoteBusy { retry_after })
            }
            Err(detail) => {
                self.failed.fetch_add(1, Ordering::Relaxed);
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

    fn note_failure(&self, detail: &str) {
        if self.breaker.failed() {
            let url = self.connection.address();
            tracing::warn!(%url, "the inference server is unavailable: {detail}");
        }
    }

    pub(super) fn denied(&self, detail: String) -> InferenceError {
        InferenceError::RemoteDenied {
            url: self.connection.address().to_string(),
            detail,
        }
    }

    pub(super) fn unavailable(&self, detail: String) -> InferenceError {
        InferenceError::Remote {
            url: self.connection.address().to_string(),
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

//! An inference server as all sessions and whoever looks after it share it.

use std::{
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use bytes::Bytes;
use url::Url;

use super::{
    breaker::Breaker,
    connection::{Connection, Reply},
    exchange::{Answer, Question},
    token::BearerToken,
};
use crate::inference::InferenceError;

/// Longest that the server may take to say that it is ready.
const PROBE_PATIENCE: Duration = Duration::from_secs(2);
/// Whoever answered this recently need not be asked how it is.
const RECENT: Duration = Duration::from_secs(2);
/// When to come again, where a busy server says nothing.
const RETRY_AFTER: Duration = Duration::from_secs(1);
/// Most characters of the server's own words that are told.
const MAX_TOLD_CHARS: usize = 300;

/// Where networks run.
#[derive(Debug, Clone, PartialEq)]
pub struct RemoteOptions {
    /// The server's address, without `/v2`.
    pub url: Url,
    /// Sent with every request, if there is one.
    pub token: Option<BearerToken>,
    /// The model there whose readiness stands for the server's.
    pub model: String,
    /// The name in manifests of the model that is called `model` there; others are called the same.
    pub called: String,
    /// Longest that one request to infer may take.
    pub patience: Duration,
}

/// How often requests to infer came out how since the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RemoteCounts {
    /// Answered.
    pub answered: u64,
    /// Refused, as there was no place for more.
    pub busy: u64,
    /// Not answered, or not with what was asked for.
    pub failed: u64,
    /// Not sent, as the breaker was open.
    pub not_sent: u64,
}

/// An inference server. Blocks: keep it off the async runtime.
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
    /// The server that the options name. Sends nothing yet.
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

    /// Whether requests are sent to it: the breaker is closed.
    #[must_use]
    pub fn is_available(&self) -> bool {
        !self.breaker.is_open()
    }

    /// How often requests to infer came out how.
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

    /// Looks whether it is there, unless its answers tell that already; returns whether requests are sent
    /// to it from now on. Whoever calls this every second or so makes it recover by itself.
    pub fn look_after(&self) -> bool {
        if self.is_available() && self.tells_by_itself() {
            return true;
        }
        match self.ready() {
            Ok(()) => {
                if self.breaker.close() {
                    tracing::info!(url = %self.connection.address(), "the inference server is there again");
                }
            }
            Err(detail) => self.note_failure(&detail),
        }
        self.is_available()
    }

    /// What a model is called there whose manifest has this name.
    pub(super) fn name_of<'a>(&'a self, name: &'a str) -> &'a str {
        if name == self.options.called {
            &self.options.model
        } else {
            name
        }
    }

    /// Asks for what is at a path.
    pub(super) fn get(&self, path: &[&str]) -> Result<Reply, InferenceError> {
        let reply = self.connection.get(path, self.options.patience);
        reply.map_err(|detail| self.away(detail))
    }

    /// Has a model answer. A server that is ready and still refuses with 503 has no place, as one that
    /// answers 429.
    pub(super) fn infer(
        &self,
        model: &str,
        question: &Question<'_>,
    ) -> Result<Answer, InferenceError> {
        if self.breaker.is_open() {
            self.not_sent.fetch_add(1, Ordering::Relaxed);
            return Err(self.away(
                "it has not answered lately, and is not asked until it is ready".to_owned(),
            ));
        }
        let (body, head_length) = question
            .body()
            .map_err(|error| InferenceError::Run(error.to_string()))?;
        let path = ["v2", "models", model, "infer"];
        self.in_flight.fetch_add(1, Ordering::Relaxed);
        let reply = self.connection.post(&path, &Bytes::from(body), head_length);
        self.in_flight.fetch_sub(1, Ordering::Relaxed);
        let wait = |reply: &Reply| reply.retry_after.unwrap_or(RETRY_AFTER);
        let answer = reply.and_then(|reply| match reply.status {
            200 => Answer::read(&reply.body, reply.head_length).map(Ok),
            429 => Ok(Err(wait(&reply))),
            503 if self.ready().is_ok() => Ok(Err(wait(&reply))),
            _ => Err(refusal(&reply)),
        });
        if answer.is_ok() {
            self.breaker.succeeded();
            *self
                .answered_at
                .lock()
                .unwrap_or_else(PoisonError::into_inner) = Some(Instant::now());
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
                Err(self.away(detail))
            }
        }
    }

    fn ready(&self) -> Result<(), String> {
        let path = ["v2", "models", &self.options.model, "ready"];
        let reply = self.connection.get(&path, PROBE_PATIENCE)?;
        match reply.status {
            200 => Ok(()),
            _ => Err(refusal(&reply)),
        }
    }

    /// Whether somebody waits for an answer, or got one just now: a server that computes may have no time
    /// for other questions.
    fn tells_by_itself(&self) -> bool {
        let answered_at = self
            .answered_at
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let recently = answered_at.is_some_and(|at| at.elapsed() < RECENT);
        recently || self.in_flight.load(Ordering::Relaxed) > 0
    }

    fn note_failure(&self, detail: &str) {
        if self.breaker.failed() {
            let url = self.connection.address();
            tracing::warn!(%url, "the inference server is away, and no requests are sent to it: {detail}");
        }
    }

    pub(super) fn denied(&self, detail: String) -> InferenceError {
        InferenceError::RemoteDenied {
            url: self.connection.address().to_string(),
            detail,
        }
    }

    pub(super) fn away(&self, detail: String) -> InferenceError {
        InferenceError::Remote {
            url: self.connection.address().to_string(),
            detail,
        }
    }
}

/// A status that is no success, with the server's own words.
pub(super) fn refusal(reply: &Reply) -> String {
    let status = reply.status;
    let told = String::from_utf8_lossy(&reply.body);
    let told: String = told
        .chars()
        .filter(|c| !c.is_control())
        .take(MAX_TOLD_CHARS)
        .collect();
    format!("it answered {status}: {told}")
}

//! The deadline of a request. All work for the request ends there.

use std::{convert::Infallible, future::Future, time::Duration};

use axum::{
    extract::{FromRef, FromRequestParts},
    http::request::Parts,
};
use lookdown_detect::pipeline::PipelineError;
use tokio::{
    task::spawn_blocking,
    time::{Instant, timeout_at},
};

use super::problem::{Problem, ProblemKind};

/// The longest duration of a request, from its first byte to its response.
#[derive(Debug, Clone, Copy)]
pub(in crate::api) struct RequestTimeout(pub(in crate::api) Duration);

/// The time at which a response must be complete.
#[derive(Debug, Clone, Copy)]
pub(in crate::api) struct Deadline {
    began: Instant,
    limit: Duration,
}

impl Deadline {
    /// Returns the deadline `limit` from now.
    pub(in crate::api) fn begin(limit: Duration) -> Self {
        let began = Instant::now();
        Self { began, limit }
    }

    /// Returns the deadline of the request with this head, set when the request arrived.
    pub(in crate::api) fn of<S>(parts: &Parts, state: &S) -> Self
    where
        RequestTimeout: FromRef<S>,
    {
        let begun = parts.extensions.get().copied();
        begun.unwrap_or_else(|| Self::begin(RequestTimeout::from_ref(state).0))
    }

    /// Returns this deadline, but at most `limit` after the request arrived.
    pub(in crate::api) fn within(self, limit: Duration) -> Self {
        let limit = limit.min(self.limit);
        Self { limit, ..self }
    }

    /// Returns the time at which the request arrived.
    pub(in crate::api) fn began(self) -> Instant {
        self.began
    }

    pub(in crate::api) fn at(self) -> Instant {
        self.began + self.limit
    }

    /// Returns the longest duration of the request in seconds.
    pub(in crate::api) fn limit_seconds(self) -> f64 {
        self.limit.as_secs_f64()
    }

    /// Waits for work that holds a permit of the frame queue. Work that has not begun at the
    /// deadline never begins. `undone` is the start of the error sentence.
    pub(in crate::api) async fn wait<T>(
        self,
        undone: &str,
        work: impl Future<Output = Result<T, PipelineError>>,
    ) -> Result<T, Problem> {
        let done = timeout_at(self.at(), work).await;
        let done = done.map_err(|_| {
            let seconds = self.limit_seconds();
            let detail = format!(
                "{undone} within {seconds} s: send fewer requests, or raise server.request_timeout_millis"
            );
            Problem::new(ProblemKind::Timeout, detail)
        })?;
        Ok(done?)
    }

    /// Runs blocking work on a thread outside the async runtime, in the span of the request. Work
    /// that has begun is never interrupted: it continues after the request has timed out.
    pub(in crate::api) async fn blocking<T, E>(
        self,
        work: impl FnOnce() -> Result<T, E> + Send + 'static,
    ) -> Result<T, Problem>
    where
        T: Send + 'static,
        E: Into<Problem> + Send + 'static,
    {
        let request = tracing::Span::current();
        let work = move || request.in_scope(work);
        let done = timeout_at(self.at(), spawn_blocking(work)).await;
        let done = done.map_err(|_| {
            let detail = format!(
                "this is not done within {} s, and goes on: look later whether it has succeeded, \
                 or raise server.request_timeout_millis",
                self.limit_seconds()
            );
            Problem::new(ProblemKind::Timeout, detail)
        })?;
        done.map_err(Problem::internal)?.map_err(Into::into)
    }
}

impl<S> FromRequestParts<S> for Deadline
where
    S: Sync,
    RequestTimeout: FromRef<S>,
{
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Infallible> {
        Ok(Self::of(parts, state))
    }
}

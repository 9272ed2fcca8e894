//! How long a request may take. Whatever waits on its behalf waits no longer than that.

use std::{convert::Infallible, future::Future, time::Duration};

use axum::{extract::FromRequestParts, http::request::Parts};
use tokio::{
    task::spawn_blocking,
    time::{Instant, timeout_at},
};

use super::{
    ApiState,
    problem::{Problem, ProblemKind},
};
use crate::pipeline::PipelineError;

/// When a request must have been answered.
#[derive(Debug, Clone, Copy)]
pub(super) struct Deadline {
    began: Instant,
    limit: Duration,
}

impl Deadline {
    /// `limit` from now.
    pub(super) fn begin(limit: Duration) -> Self {
        let began = Instant::now();
        Self { began, limit }
    }

    /// That of a request with this head: the one it got when it came.
    pub(super) fn of(parts: &Parts, state: &ApiState) -> Self {
        let begun = parts.extensions.get().copied();
        begun.unwrap_or_else(|| Self::begin(state.options.request_timeout))
    }

    /// The same, but no later than `limit` after the request came.
    pub(super) fn within(self, limit: Duration) -> Self {
        let limit = limit.min(self.limit);
        Self { limit, ..self }
    }

    /// When the request came.
    pub(super) fn began(self) -> Instant {
        self.began
    }

    pub(super) fn at(self) -> Instant {
        self.began + self.limit
    }

    /// How long the request may take in all, seconds.
    pub(super) fn limit_seconds(self) -> f64 {
        self.limit.as_secs_f64()
    }

    /// Waits for work that has a place among the frames; what of it has not begun by then never will. `undone`
    /// begins the sentence for whoever is told so.
    pub(super) async fn wait<T>(
        self,
        undone: &str,
        work: impl Future<Output = Result<T, PipelineError>>,
    ) -> Result<T, Problem> {
        let done = timeout_at(self.at(), work).await;
        let done = done.map_err(|_| {
            let seconds = self.limit_seconds();
            let detail = format!(
                "{undone} within {seconds} s: ask less often, or raise server.request_timeout_millis"
            );
            Problem::new(ProblemKind::Timeout, detail)
        })?;
        Ok(done?)
    }

    /// Does work that blocks, away from the async runtime; what it logs is still the request's. Work
    /// that has begun is never cut off: it goes on when its request is given up.
    pub(super) async fn blocking<T, E>(
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

impl FromRequestParts<ApiState> for Deadline {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, state: &ApiState) -> Result<Self, Infallible> {
        Ok(Self::of(parts, state))
    }
}

//! The time that a request waits for the workers: the deadline of every request, or a shorter one
//! that the request sets.

use std::{future::Future, time::Duration, time::Instant};

use lookdown_detect::pipeline::{PipelineError, Timeline};
use tokio::time::timeout_at;

use crate::{
    api::http::{
        deadline::Deadline,
        problem::{Problem, ProblemKind},
    },
    telemetry::RequestTrace,
};

/// The time limit of a wait.
pub(super) struct Limit {
    deadline: Deadline,
    /// The setting or parameter that raises the limit.
    set_by: &'static str,
}

impl Limit {
    /// Returns the shorter of the server's limit and the request's own.
    pub(super) fn of(server: Deadline, own: Option<Duration>) -> Self {
        let deadline = own.map_or(server, |own| server.within(own));
        let set_by = if deadline.at() < server.at() {
            "timeout_millis"
        } else {
            "server.request_timeout_millis"
        };
        Self { deadline, set_by }
    }

    /// Waits for work and adds its stages to the trace.
    pub(super) async fn wait<T>(
        &self,
        trace: &RequestTrace,
        timeline: &Timeline,
        work: impl Future<Output = Result<T, PipelineError>>,
    ) -> Result<T, Problem> {
        let outcome = timeout_at(self.deadline.at(), work).await;
        for span in timeline.spans(Instant::now()) {
            trace.stage(span.stage.name(), span.began, span.ended);
        }
        Ok(outcome.map_err(|_| self.timed_out())??)
    }

    fn timed_out(&self) -> Problem {
        let (seconds, set_by) = (self.deadline.limit_seconds(), self.set_by);
        let detail = format!(
            "no result within {seconds} s: send fewer frames or views at a time, use a faster \
             profile for frames, or raise {set_by}"
        );
        Problem::new(ProblemKind::Timeout, detail)
    }
}

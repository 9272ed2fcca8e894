//! A detection request whose whole body is in memory.

use std::time::Instant;

use axum::{
    extract::{FromRequest, Request},
    http::request::Parts,
};
use bytes::Bytes;
use jiff::Timestamp;

use crate::{
    access::Scope,
    api::{
        ApiState,
        caller::Caller,
        http::{
            deadline::Deadline,
            problem::Problem,
            request_body::{BodyReader, Held, UploadBudget},
        },
        readiness::Phase,
    },
};

/// A complete detection request. As an extractor, it also checks the scope `detect`.
pub(in crate::api) struct ReceivedRequest {
    pub(in crate::api) parts: Parts,
    /// The caller by the key in the headers.
    pub(in crate::api) caller: Caller,
    pub(in crate::api) body: Held<Bytes>,
    /// The deadline of the response.
    pub(in crate::api) deadline: Deadline,
    /// Time at which the request arrived.
    pub(in crate::api) received_at: Timestamp,
    /// Time at which the whole body was in memory.
    pub(in crate::api) arrived: Instant,
}

impl FromRequest<ApiState> for ReceivedRequest {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let access = &state.options.access;
        access.check(request.headers(), Scope::Detect)?;
        Self::receive(request, state, &state.uploads).await
    }
}

impl ReceivedRequest {
    /// Reads the request, whose body uses memory of `budget`. The key is not checked here.
    pub(in crate::api) async fn receive(
        request: Request,
        state: &ApiState,
        budget: &UploadBudget,
    ) -> Result<Self, Problem> {
        let received_at = Timestamp::now();
        let (parts, body) = request.into_parts();
        if state.readiness.phase() == Phase::WarmingUp {
            return Err(Problem::warming_up());
        }
        let caller = Caller::of(&parts, state);
        // A frame that finds no place in the queue is refused before its body is read.
        state.workers.admits(&caller.client)?;
        let deadline = Deadline::of(&parts, state);
        let max_bytes = state.options.max_body_bytes;
        let remedy = "send a smaller image or raise server.max_body_bytes";
        let reader = BodyReader {
            budget: budget.of(&caller.client),
            ..state.body_reader(&caller.client, max_bytes, remedy, deadline)
        };
        let body = reader.read(&parts.headers, body).await?;
        Ok(Self {
            parts,
            caller,
            body,
            deadline,
            received_at,
            arrived: Instant::now(),
        })
    }
}

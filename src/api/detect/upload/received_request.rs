//! A detection request whose whole body is in memory.

use std::{sync::Arc, time::Instant};

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
        http::{
            context::RequestContext,
            problem::Problem,
            request_body::{BodyReader, Held, UploadBudget},
        },
        readiness::Phase,
    },
};

/// A complete detection request. As an extractor, it also checks the scope `detect`.
pub(in crate::api) struct ReceivedRequest {
    pub(in crate::api) parts: Parts,
    pub(in crate::api) context: Arc<RequestContext>,
    pub(in crate::api) body: Held<Bytes>,
    /// Time at which the request arrived.
    pub(in crate::api) received_at: Timestamp,
    /// Time at which the whole body was in memory.
    pub(in crate::api) arrived: Instant,
}

impl FromRequest<ApiState> for ReceivedRequest {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let context = RequestContext::from_extensions(request.extensions())?;
        let access = &state.options.access;
        access.check(request.headers(), &context.identity, Scope::Detect)?;
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
        let context = RequestContext::from_extensions(&parts.extensions)?;
        let client = &context.caller.client;
        // A frame that finds no place in the queue is refused before its body is read.
        state.workers.admits(client)?;
        let max_bytes = state.options.max_body_bytes;
        let remedy = "send a smaller image or raise server.max_body_bytes";
        let reader = BodyReader {
            budget: budget.for_client(client),
            ..state.body_reader(&context, max_bytes, remedy)
        };
        let body = reader.read(&parts.headers, body).await?;
        Ok(Self {
            parts,
            context,
            body,
            received_at,
            arrived: Instant::now(),
        })
    }
}

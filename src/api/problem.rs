//! The one error envelope: RFC 9457 problem details.
//!
//! A handler returns a [`Problem`]; the [envelope](super::envelope) writes it down with the path
//! and the request ID, logs its cause and counts it. Statuses: 400 malformed, 401 no known key, 403 not
//! allowed, 404
//! unknown calibration, camera or model, 406 nothing that is accepted, 408 slow upload, 409 not while the models or
//! calibrations are as they are,
//! 412 outdated, 413 too
//! many bytes or pixels, 415 not a picture that can be read, 422 understood but unusable, 429 no
//! place in the queue or among the listeners, or another model is being loaded, 503 no place at all (not ready or shutting
//! down), 504 deadline.

mod calibration;
mod kind;
mod pipeline;

use std::{sync::Arc, time::Duration};

use axum::{
    http::{
        HeaderValue, StatusCode,
        header::{RETRY_AFTER, WWW_AUTHENTICATE},
    },
    response::{IntoResponse, Response},
};
use serde::Serialize;
use utoipa::ToSchema;

use super::deepstack;

pub(super) use kind::ProblemKind;

/// Whoever is told to wait longer than this has been forgotten.
const MAX_RETRY_AFTER_SECONDS: u64 = 60;

/// A request that got no result.
#[derive(Debug, Clone)]
pub(super) struct Problem {
    kind: ProblemKind,
    detail: String,
    /// When to come again, if that is known better than from the kind.
    retry_after: Option<Duration>,
    /// What really happened; logged, never shown.
    cause: Option<Arc<anyhow::Error>>,
}

impl Problem {
    /// A problem that is told to the client in one sentence.
    pub(super) fn new(kind: ProblemKind, detail: impl Into<String>) -> Self {
        Self {
            kind,
            detail: detail.into(),
            retry_after: None,
            cause: None,
        }
    }

    /// A fault of ours: the client learns nothing but that.
    pub(super) fn internal(cause: impl Into<anyhow::Error>) -> Self {
        Self {
            cause: Some(Arc::new(cause.into())),
            ..Self::fault()
        }
    }

    /// A fault of ours that was logged where it happened.
    pub(super) fn fault() -> Self {
        Self::new(
            ProblemKind::Internal,
            "the request could not be answered because of a fault in the server, which has \
             logged it under this request_id",
        )
    }

    /// The network has not run yet.
    pub(super) fn warming_up() -> Self {
        Self::new(
            ProblemKind::WarmingUp,
            "the server is warming up: try again in a second",
        )
    }

    /// The server was told to stop.
    pub(super) fn shutting_down() -> Self {
        let detail = "the server is shutting down: send the request to another one";
        Self::new(ProblemKind::ShuttingDown, detail)
    }

    /// The same, with the time after which another try is worth while.
    pub(super) fn with_retry_after(self, retry_after: Duration) -> Self {
        Self {
            retry_after: Some(retry_after),
            ..self
        }
    }

    pub(super) fn kind(&self) -> ProblemKind {
        self.kind
    }

    pub(super) fn cause(&self) -> Option<&anyhow::Error> {
        self.cause.as_deref()
    }

    /// The status with which a request for this path is answered.
    pub(super) fn status_at(&self, path: &str) -> StatusCode {
        if deepstack::speaks_at(path) {
            deepstack::status_of(self.kind)
        } else {
            self.kind.status()
        }
    }

    /// As it is written to a client.
    pub(super) fn body(self, path: &str, request_id: &str) -> ProblemBody {
        ProblemBody {
            r#type: self.kind.urn(),
            title: self.kind.title(),
            status: self.status_at(path).as_u16(),
            error: self.detail.clone(),
            detail: self.detail,
            instance: path.to_owned(),
            request_id: request_id.to_owned(),
            success: deepstack::speaks_at(path).then_some(false),
        }
    }
}

/// Status and headers; the envelope writes the body.
impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let mut response = self.kind.status().into_response();
        if let Some(least) = self.kind.retry_after_seconds() {
            let wanted = self.retry_after.map_or(0, |after| after.as_secs() + 1);
            let seconds = HeaderValue::from(wanted.clamp(least, MAX_RETRY_AFTER_SECONDS));
            response.headers_mut().insert(RETRY_AFTER, seconds);
        }
        if self.kind == ProblemKind::KeyRequired {
            let scheme = HeaderValue::from_static("Bearer");
            response.headers_mut().insert(WWW_AUTHENTICATE, scheme);
        }
        response.extensions_mut().insert(self);
        response
    }
}

/// Why a request got no result (RFC 9457).
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Problem, example = json!({
    "type": "urn:lookdown:problem:invalid-parameter",
    "title": "A parameter cannot be used",
    "status": 422,
    "detail": "score_threshold: 1.5 is outside 0 to 1",
    "instance": "/detect",
    "error": "score_threshold: 1.5 is outside 0 to 1",
    "request_id": "0197a3c5-8f0e-7c3e-9a55-2f8e4b1d6c70"
}))]
pub(super) struct ProblemBody {
    /// Identifies the kind of problem; stable.
    r#type: String,
    /// The kind of problem in words.
    title: &'static str,
    /// The HTTP status.
    status: u16,
    /// What is wrong with this request and what would be right; names the field, if it is one.
    detail: String,
    /// The path of the request.
    instance: String,
    /// The same as `detail`, for clients that look for it here.
    error: String,
    /// Identifies the request in the server's log.
    request_id: String,
    /// Always false; only below `/v1/vision`, whose clients look for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    success: Option<bool>,
}

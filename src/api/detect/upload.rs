//! A frame and its parameters: `multipart/form-data`, or the frame as the body with the parameters
//! in the query.
//!
//! The whole body is read first, within limits.

mod form;

pub(in crate::api) use form::{FieldUse, frames_among};

use std::{sync::Arc, time::Instant};

use axum::{
    extract::{FromRequest, Request},
    http::{
        HeaderMap, HeaderValue,
        header::{CONTENT_ENCODING, CONTENT_TYPE},
        request::Parts,
    },
};
use bytes::Bytes;
use form::{Form, frame_in_query, use_in_detection};
use jiff::Timestamp;
use lookdown_common::text::Quoted;
use lookdown_detect::{parameters::DetectParameters, pipeline::DetectJob};

use crate::{
    access::Scope,
    api::{
        ApiState,
        http::{
            access::Caller,
            context::RequestContext,
            problem::{Problem, ProblemKind},
            query::query_parameters,
            request_body::{BodyReader, Held, UploadBudget},
        },
        state::Phase,
    },
};

/// A frame in memory with the parameters of its request.
pub(in crate::api) struct Upload {
    /// The form; one with nothing but the frame if the frame is the body.
    pub(in crate::api) form: Form,
    /// The headers of the request, such as `Accept`.
    pub(in crate::api) headers: HeaderMap,
    /// The context of the request.
    pub(in crate::api) context: Arc<RequestContext>,
    /// The caller, by a key in the headers or in the form.
    pub(in crate::api) caller: Caller,
    /// Time at which the request arrived.
    pub(in crate::api) received_at: Timestamp,
    /// Time at which the whole body was in memory.
    pub(in crate::api) arrived: Instant,
}

impl FromRequest<ApiState> for Upload {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        Self::accept(request, state, use_in_detection).await
    }
}

impl Upload {
    /// Reads the frame and the parameters of a client that may detect. `use_of` classifies the
    /// names of the form and of the query.
    pub(in crate::api) async fn accept(
        request: Request,
        state: &ApiState,
        use_of: fn(&str) -> Result<FieldUse, Problem>,
    ) -> Result<Self, Problem> {
        check_may_detect(&request, state)?;
        let uri = request.uri().clone();
        let mut upload = Self::receive(request, state, &state.uploads, use_of).await?;
        let mut parameters = query_parameters(&uri)?;
        for (name, _) in &parameters {
            if use_of(name)? != FieldUse::Parameter {
                return Err(frame_in_query(name));
            }
        }
        parameters.append(&mut upload.form.parameters);
        upload.form.parameters = parameters;
        Ok(upload)
    }

    /// Returns the detection job with the parsed parameters.
    ///
    /// # Errors
    /// [`Problem`] if the caller may not use the priority.
    pub(in crate::api) fn job(self, parameters: DetectParameters) -> Result<DetectJob, Problem> {
        let ticket = self.caller.ticket_at(parameters.priority)?;
        let (received_at, arrived) = (self.received_at, self.arrived);
        Ok(DetectJob::sent(
            self.form.image,
            parameters,
            ticket,
            received_at,
            arrived,
        ))
    }

    /// Reads a frame, alone or in a form whose fields `use_of` classifies by name. The body uses
    /// memory of `budget`. The key is not checked here.
    pub(in crate::api) async fn receive(
        request: Request,
        state: &ApiState,
        budget: &UploadBudget,
        use_of: fn(&str) -> Result<FieldUse, Problem>,
    ) -> Result<Self, Problem> {
        let ReceivedRequest {
            parts,
            context,
            body: held,
            received_at,
            arrived,
        } = ReceivedRequest::receive(request, state, budget).await?;
        let headers = parts.headers.clone();
        check_encoding(&headers)?;
        let form = if is_multipart(&headers) {
            let form = form::parse(parts, held.bytes(), use_of).await?;
            Form {
                image: held.with_bytes(form.image).into_bytes(),
                ..form
            }
        } else {
            Form {
                image: held.into_bytes(),
                ..Form::default()
            }
        };
        Ok(Self {
            form,
            headers,
            caller: context.caller.clone(),
            context,
            received_at,
            arrived,
        })
    }
}

/// Refuses a compressed body: images are compressed already.
fn check_encoding(headers: &HeaderMap) -> Result<(), Problem> {
    let encoding = headers.get(CONTENT_ENCODING).map(HeaderValue::as_bytes);
    let Some(encoding) = encoding.filter(|encoding| !encoding.eq_ignore_ascii_case(b"identity"))
    else {
        return Ok(());
    };
    let encoding = String::from_utf8_lossy(encoding);
    let encoding = Quoted(&encoding);
    let detail = format!("Content-Encoding is {encoding}: send the image without this compression");
    Err(Problem::new(ProblemKind::UnsupportedImage, detail))
}

/// Returns `true` if the body is a multipart form.
pub(in crate::api) fn is_multipart(headers: &HeaderMap) -> bool {
    let content_type = headers.get(CONTENT_TYPE);
    content_type.is_some_and(|value| {
        let value = value.as_bytes();
        value.len() >= 10 && value[..10].eq_ignore_ascii_case(b"multipart/")
    })
}

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

/// Checks that the key of a request may detect.
fn check_may_detect(request: &Request, state: &ApiState) -> Result<(), Problem> {
    let context = RequestContext::from_extensions(request.extensions())?;
    let access = &state.options.access;
    let holder = context.holder.as_ref();
    access.check(request.headers(), holder, None, Scope::Detect)?;
    Ok(())
}

impl FromRequest<ApiState> for ReceivedRequest {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        check_may_detect(&request, state)?;
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
        let max_bytes = state.options.settings.server.max_body_bytes;
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

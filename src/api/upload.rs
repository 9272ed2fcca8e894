//! A frame and its parameters: `multipart/form-data`, or the frame as the body with the parameters
//! in the query.
//!
//! The whole body is read first, within limits: its size, its rate, the deadline of the request,
//! and the memory of all requests together.

mod body;
mod budget;
mod form;
mod minimum_upload_rate;
mod names;
mod received_request;

use std::time::Instant;

use axum::{
    extract::{FromRequest, Query, Request},
    http::{HeaderMap, Uri, header::CONTENT_TYPE},
};
use bytes::Bytes;
use jiff::Timestamp;

pub(super) use body::{BodyReader, next_chunk};
pub(super) use budget::{Held, UploadBudget};
pub(super) use minimum_upload_rate::MinimumUploadRate;
pub(super) use received_request::ReceivedRequest;

use names::{is_parameter, unknown_parameter};

pub(super) use form::FieldUse;

use super::{
    ApiState,
    caller::Caller,
    deadline::Deadline,
    problem::{Problem, ProblemKind},
};
use crate::{
    access::Scope,
    pipeline::{DetectJob, DetectParameters, ParameterError},
};

/// A frame in memory with the parameters of its request.
pub(super) struct Upload {
    /// The encoded frame.
    pub(super) image: Bytes,
    /// The name of its file, if it was sent.
    pub(super) file_name: Option<String>,
    /// The headers of the request, such as `Accept`.
    pub(super) headers: HeaderMap,
    /// The caller.
    pub(super) caller: Caller,
    /// Parameters by name. The names are checked, the values are not.
    pub(super) parameters: Vec<(String, String)>,
    /// The deadline of the response.
    pub(super) deadline: Deadline,
    /// Time at which the request arrived.
    pub(super) received_at: Timestamp,
    /// Time at which the whole body was in memory.
    pub(super) arrived: Instant,
}

impl FromRequest<ApiState> for Upload {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let access = &state.options.access;
        access.check(request.headers(), Scope::Detect)?;
        let uri = request.uri().clone();
        let mut upload = Self::receive(request, state, &state.uploads, names::use_of).await?;
        let mut parameters = query_parameters(&uri)?;
        if let Some((name, _)) = parameters.iter().find(|(name, _)| !is_parameter(name)) {
            return Err(unknown_parameter(name));
        }
        parameters.append(&mut upload.parameters);
        upload.parameters = parameters;
        Ok(upload)
    }
}

impl Upload {
    /// Returns the detection job with the parsed parameters.
    ///
    /// # Errors
    /// [`Problem`] if the caller may not use the priority.
    pub(super) fn job(self, parameters: DetectParameters) -> Result<DetectJob, Problem> {
        let ticket = self.caller.ticket_at(parameters.priority)?;
        let (received_at, arrived) = (self.received_at, self.arrived);
        Ok(DetectJob::sent(
            self.image,
            parameters,
            ticket,
            received_at,
            arrived,
        ))
    }

    /// Reads a frame, alone or in a form whose fields `use_of` classifies by name. The body uses
    /// memory of `budget`. The key is not checked here.
    pub(super) async fn receive(
        request: Request,
        state: &ApiState,
        budget: &UploadBudget,
        use_of: fn(&str) -> FieldUse,
    ) -> Result<Self, Problem> {
        let ReceivedRequest {
            parts,
            caller,
            body: held,
            deadline,
            received_at,
            arrived,
        } = ReceivedRequest::receive(request, state, budget).await?;
        let headers = parts.headers.clone();
        let (image, file_name, parameters) = if is_multipart(&headers) {
            let form = form::parse(parts, held.bytes(), use_of).await?;
            (held.with_bytes(form.image), form.file_name, form.parameters)
        } else {
            (held, None, Vec::new())
        };
        Ok(Self {
            image: image.into_bytes(),
            file_name,
            headers,
            caller,
            parameters,
            deadline,
            received_at,
            arrived,
        })
    }
}

/// Returns the names and values of the query parameters.
pub(super) fn query_parameters(uri: &Uri) -> Result<Vec<(String, String)>, Problem> {
    let pairs = Query::try_from_uri(uri).ok().map(|Query(pairs)| pairs);
    // The decoder replaces bytes that are not UTF-8 by this character.
    let is_text = |text: &String| !text.contains(char::REPLACEMENT_CHARACTER);
    pairs
        .filter(|pairs: &Vec<(String, String)>| {
            pairs
                .iter()
                .all(|(name, value)| is_text(name) && is_text(value))
        })
        .ok_or_else(|| {
            let detail = "the query cannot be read: send name=value&name=value, percent-encoded \
                          UTF-8";
            Problem::new(ProblemKind::MalformedRequest, detail)
        })
}

/// Returns the values of the named query parameters, each at most once.
pub(super) fn parameters_named<const COUNT: usize>(
    uri: &Uri,
    names: [&str; COUNT],
) -> Result<[Option<String>; COUNT], Problem> {
    let mut values = [const { None }; COUNT];
    for (given, value) in query_parameters(uri)? {
        let Some(index) = names.iter().position(|name| *name == given) else {
            let known = names.join(", ");
            let problem = format!("there is no such parameter; the parameters are {known}");
            return Err(ParameterError::unknown(&given, problem).into());
        };
        if values[index].replace(value).is_some() {
            return Err(ParameterError::repeated(&given).into());
        }
    }
    Ok(values)
}

/// Returns `true` if the body is a multipart form.
pub(super) fn is_multipart(headers: &HeaderMap) -> bool {
    let content_type = headers.get(CONTENT_TYPE);
    content_type.is_some_and(|value| {
        let value = value.as_bytes();
        value.len() >= 10 && value[..10].eq_ignore_ascii_case(b"multipart/")
    })
}

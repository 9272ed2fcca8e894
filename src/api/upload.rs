//! A frame and its parameters, however they were sent: `multipart/form-data`, or the frame as the
//! body with the parameters in the query.
//!
//! The whole body is read first, within three bounds: its size, the deadline of the request, and
//! the memory that all bodies together may hold.

mod body;
mod form;

use std::time::Instant as Arrival;

use axum::{
    extract::{FromRequest, Query, Request},
    http::{Uri, header::CONTENT_TYPE, request::Parts},
};
use bytes::Bytes;
use jiff::Timestamp;
use tokio::time::{Instant, timeout_at};

pub(super) use body::{BodyReader, UploadBudget};

use super::{
    ApiState, Phase,
    problem::{Problem, ProblemKind},
};
use crate::access::Scope;

/// A frame in memory and what its sender wants of it.
pub(super) struct Upload {
    /// The encoded frame.
    pub(super) image: Bytes,
    /// Parameters by name, not checked yet.
    pub(super) parameters: Vec<(String, String)>,
    /// When the request's head was read.
    pub(super) began: Instant,
    /// When the request came.
    pub(super) received_at: Timestamp,
    /// When the whole body was in memory.
    pub(super) arrived: Arrival,
}

impl FromRequest<ApiState> for Upload {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let received_at = Timestamp::now();
        let began = Instant::now();
        let deadline = began + state.options.request_timeout;
        let (parts, body) = request.into_parts();
        let reader = BodyReader {
            max_bytes: state.options.max_body_bytes,
            remedy: "send a smaller picture or raise server.max_body_bytes",
            budget: &state.uploads,
        };
        let admitted = state
            .options
            .access
            .check(&parts.headers, Scope::Detect)
            // A frame that has no place needs none in memory either.
            .and_then(|()| Ok(state.workers.admits()?));
        let reading = async {
            if let Err(refusal) = admitted {
                reader.discard_unread(&parts.headers, body).await;
                return Err(refusal);
            }
            reader.read(&parts.headers, body).await
        };
        let held = timeout_at(deadline, reading)
            .await
            .map_err(|_| slow_upload(state))??;
        let arrived = Arrival::now();
        // Refused only now: a client in the middle of sending would not see why.
        if state.readiness.phase() == Phase::WarmingUp {
            return Err(Problem::warming_up());
        }
        let mut parameters = query_parameters(&parts.uri)?;
        let image = if is_multipart(&parts) {
            let form = form::parse(parts, held.bytes()).await?;
            parameters.extend(form.parameters);
            held.with_bytes(form.image)
        } else {
            held
        };
        Ok(Self {
            image: image.into_bytes(),
            parameters,
            began,
            received_at,
            arrived,
        })
    }
}

fn query_parameters(uri: &Uri) -> Result<Vec<(String, String)>, Problem> {
    let pairs = Query::try_from_uri(uri).ok().map(|Query(pairs)| pairs);
    // Bytes that are not UTF-8 come out of the decoder as this character.
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

/// The values of the parameters that a query may have, each at most once.
pub(super) fn parameters_named<const COUNT: usize>(
    uri: &Uri,
    names: [&str; COUNT],
) -> Result<[Option<String>; COUNT], Problem> {
    let mut values = [const { None }; COUNT];
    for (given, value) in query_parameters(uri)? {
        let Some(index) = names.iter().position(|name| *name == given) else {
            let given: String = given.chars().take(64).collect();
            let known = names.join(", ");
            let detail = format!("there is no parameter {given:?} here: there is {known}");
            return Err(Problem::new(ProblemKind::UnknownParameter, detail));
        };
        if values[index].replace(value).is_some() {
            let detail = format!("{given} is given twice: give it once");
            return Err(Problem::new(ProblemKind::RepeatedParameter, detail));
        }
    }
    Ok(values)
}

fn is_multipart(parts: &Parts) -> bool {
    let content_type = parts.headers.get(CONTENT_TYPE);
    content_type.is_some_and(|value| {
        let value = value.as_bytes();
        value.len() >= 10 && value[..10].eq_ignore_ascii_case(b"multipart/")
    })
}

fn slow_upload(state: &ApiState) -> Problem {
    let seconds = state.options.request_timeout.as_secs_f64();
    let detail = format!("the body did not arrive within {seconds} s: send a smaller picture");
    Problem::new(ProblemKind::SlowUpload, detail)
}

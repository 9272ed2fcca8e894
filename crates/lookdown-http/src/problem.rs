//! Failures as problem documents (RFC 9457): the document of all parts, and the failures that every
//! listener has. The layer around the routes writes the document.

mod kind;

use std::collections::BTreeMap;

use axum::{
    Json,
    extract::Request,
    http::{
        HeaderValue, StatusCode,
        header::{CONTENT_LENGTH, CONTENT_TYPE, RETRY_AFTER, WWW_AUTHENTICATE},
    },
    middleware::Next,
    response::{IntoResponse, Response},
};
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

use crate::{
    page_headers,
    request_id::{self, RequestId, new_id},
};

pub use kind::Kind;

/// The media type of the documents.
pub const PROBLEM_JSON: HeaderValue = HeaderValue::from_static("application/problem+json");

/// The reason why a request failed.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The kind.
    pub kind: Kind,
    /// The fault and its remedy, as one sentence.
    pub detail: String,
    /// The parameter at fault.
    pub parameter: Option<String>,
}

impl Problem {
    /// Creates a problem with a detail of one sentence.
    pub fn new(kind: Kind, detail: impl Into<String>) -> Self {
        Self {
            kind,
            detail: detail.into(),
            parameter: None,
        }
    }

    /// Creates the problem of a parameter: the detail is `parameter: fault`.
    pub fn for_parameter(parameter: &str, fault: &str) -> Self {
        Self {
            parameter: Some(parameter.to_owned()),
            ..Self::new(Kind::InvalidParameter, format!("{parameter}: {fault}"))
        }
    }

    /// A failure whose cause only the log has.
    pub fn internal() -> Self {
        let detail = "the request failed: the log has the reason under this request_id";
        Self::new(Kind::Internal, detail)
    }

    /// Returns the problem of a failed response: that of the handler, or one for a failure of the
    /// framework.
    fn take_from(response: &mut Response, method: &str, path: &str) -> Option<Self> {
        if let Some(problem) = response.extensions_mut().remove::<Self>() {
            return Some(problem);
        }
        match response.status() {
            StatusCode::NOT_FOUND => {
                let detail = format!("there is no resource at {path}: check the path");
                Some(Self::new(Kind::NotFound, detail))
            }
            StatusCode::METHOD_NOT_ALLOWED => {
                let detail =
                    format!("{path} does not support {method}: use a method of the header Allow");
                Some(Self::new(Kind::MethodNotAllowed, detail))
            }
            status if status.is_client_error() => {
                let detail = "the request is malformed: compare it with the documentation";
                Some(Self::new(Kind::MalformedRequest, detail))
            }
            status if status.is_server_error() => Some(Self::internal()),
            _ => None,
        }
    }

    fn body(self, request_id: &RequestId) -> ProblemBody {
        let entry = self.kind.entry();
        ProblemBody {
            r#type: self.kind.path(),
            title: entry.title,
            status: entry.status.as_u16(),
            error: self.detail.clone(),
            detail: self.detail,
            instance: new_id().urn().to_string(),
            request_id: request_id.as_str().to_owned(),
            parameter: self.parameter,
            members: BTreeMap::new(),
        }
    }
}

/// Status and headers; the layer around the routes writes the body.
impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let mut response = self.kind.entry().status.into_response();
        let headers = response.headers_mut();
        match self.kind {
            Kind::KeyRequired => {
                headers.insert(WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
            }
            Kind::Overloaded => {
                headers.insert(RETRY_AFTER, HeaderValue::from_static("1"));
            }
            _ => {}
        }
        response.extensions_mut().insert(self);
        response
    }
}

/// The layer around every route of a companion: request ID, problem document, security headers.
pub async fn write(mut request: Request, next: Next) -> Response {
    let request_id = RequestId::from_headers(request.headers());
    let method = request.method().clone();
    let path = request.uri().path().to_owned();
    request.extensions_mut().insert(request_id.clone());
    let mut response = next.run(request).await;
    if let Some(problem) = Problem::take_from(&mut response, method.as_str(), &path) {
        let status = problem.kind.entry().status;
        response = with_document(response, status, problem.body(&request_id));
    }
    let headers = response.headers_mut();
    headers.insert(request_id::HEADER, request_id.header_value());
    page_headers::complete(headers);
    response
}

/// Writes a document as the body and keeps the headers of the response (`Allow`, `Retry-After` …).
pub fn with_document(response: Response, status: StatusCode, document: ProblemBody) -> Response {
    let body = Json(document).into_response();
    let (mut parts, _) = response.into_parts();
    parts.status = status;
    parts.headers.remove(CONTENT_LENGTH);
    parts.headers.insert(CONTENT_TYPE, PROBLEM_JSON);
    Response::from_parts(parts, body.into_body())
}

/// The reason why a request failed (RFC 9457).
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Problem, example = json!({
    "type": "/problems/invalid-parameter",
    "title": "Invalid parameter",
    "status": 422,
    "detail": "score_threshold: 1.5 is outside 0 to 1",
    "instance": "urn:uuid:0197a3c5-8f0e-7c3e-9a55-2f8e4b1d6c71",
    "error": "score_threshold: 1.5 is outside 0 to 1",
    "parameter": "score_threshold",
    "request_id": "0197a3c5-8f0e-7c3e-9a55-2f8e4b1d6c70"
}))]
pub struct ProblemBody {
    /// Identifies the kind of problem: the path of its documentation on this server. Stable.
    #[schema(format = "uri-reference")]
    pub r#type: String,
    /// The kind of problem in words.
    pub title: &'static str,
    /// The HTTP status.
    pub status: u16,
    /// The fault of this request and its remedy, as one sentence.
    pub detail: String,
    /// Identifies this occurrence, also in the server's log.
    #[schema(format = "uri")]
    pub instance: String,
    /// The same as `detail`, for clients that expect it here.
    pub error: String,
    /// Identifies the request: the client's own `X-Request-Id`, or a generated one.
    pub request_id: String,
    /// The parameter, form field or field of the calibration at fault; absent where none is.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub parameter: Option<String>,
    /// Members that a protocol adds to the document.
    #[serde(flatten)]
    #[schema(ignore)]
    pub members: BTreeMap<&'static str, Value>,
}

//! Failures as problem documents (RFC 9457), as the server writes them.

use axum::{
    http::{
        HeaderValue, Method, StatusCode,
        header::{CONTENT_TYPE, WWW_AUTHENTICATE},
    },
    response::{IntoResponse, Response},
};
use serde_json::json;

/// The reason why a request failed.
#[derive(Debug)]
pub(super) struct Problem {
    status: StatusCode,
    title: &'static str,
    detail: String,
}

impl Problem {
    /// A parameter that cannot be used: the detail is `parameter: fault`.
    pub(super) fn of_parameter(parameter: &str, fault: &str) -> Self {
        Self {
            status: StatusCode::UNPROCESSABLE_ENTITY,
            title: "Invalid parameter",
            detail: format!("{parameter}: {fault}"),
        }
    }

    pub(super) fn not_found(detail: String) -> Self {
        Self {
            status: StatusCode::NOT_FOUND,
            title: "Not found",
            detail,
        }
    }

    pub(super) fn method(method: &Method) -> Self {
        Self {
            status: StatusCode::METHOD_NOT_ALLOWED,
            title: "Method not allowed",
            detail: format!("the path does not support {method}: use GET"),
        }
    }

    pub(super) fn unauthorized() -> Self {
        Self {
            status: StatusCode::UNAUTHORIZED,
            title: "Authentication required",
            detail: "the request has no valid key: send the key of counts.api_key_file as \
                     Authorization: Bearer KEY or X-API-Key: KEY"
                .to_owned(),
        }
    }

    /// A failure whose cause only the log has.
    pub(super) fn internal() -> Self {
        Self {
            status: StatusCode::INTERNAL_SERVER_ERROR,
            title: "Internal error",
            detail: "the request failed: the log of lookdown count has the reason".to_owned(),
        }
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let body = json!({
            "title": self.title, "status": self.status.as_u16(), "detail": self.detail,
        });
        let content_type = [(CONTENT_TYPE, "application/problem+json")];
        let mut response = (self.status, content_type, body.to_string()).into_response();
        if self.status == StatusCode::UNAUTHORIZED {
            let challenge = HeaderValue::from_static("Bearer");
            response.headers_mut().insert(WWW_AUTHENTICATE, challenge);
        }
        response
    }
}

//! Failures in the form that DeepStack's clients expect: 400 for any fault of the frame or of a
//! field, 500 for a deadline that has passed, and `success: false` in the body. Statuses without a
//! counterpart in DeepStack (429, 503) stay, because they come with `Retry-After`.

use axum::{
    Router,
    http::{Method, StatusCode, Uri},
    middleware::map_response,
    response::Response,
    routing::any,
};
use tower_http::catch_panic::CatchPanicLayer;

use crate::api::{
    ApiState,
    http::{
        envelope,
        problem::{Problem, ProblemKind},
    },
};

/// Paths of DeepStack without a route here.
const OTHER_PATHS: &str = "/v1/vision/{*path}";

/// Adds the response layer to the routes of DeepStack, and to the paths below them that have no
/// route.
pub(in crate::api) fn with_failures(routes: Router<ApiState>) -> Router<ApiState> {
    let not_found = any(async || StatusCode::NOT_FOUND);
    routes
        .route(OTHER_PATHS, not_found)
        .layer(CatchPanicLayer::custom(envelope::panic_response))
        .layer(map_response(as_deepstack))
}

/// Changes the problem of a failed response.
async fn as_deepstack(method: Method, uri: Uri, mut response: Response) -> Response {
    if let Some(problem) = Problem::take_from(&mut response, method.as_str(), uri.path()) {
        let status = status_of(problem.kind());
        let problem = problem.with_status(status).with_member("success", false);
        *response.status_mut() = status;
        response.extensions_mut().insert(problem);
    }
    response
}

/// The status that DeepStack has for a kind of problem.
fn status_of(kind: ProblemKind) -> StatusCode {
    match kind {
        ProblemKind::ImageTooLarge => StatusCode::BAD_REQUEST,
        ProblemKind::Timeout => StatusCode::INTERNAL_SERVER_ERROR,
        kind => match kind.status() {
            StatusCode::UNSUPPORTED_MEDIA_TYPE | StatusCode::UNPROCESSABLE_ENTITY => {
                StatusCode::BAD_REQUEST
            }
            status => status,
        },
    }
}

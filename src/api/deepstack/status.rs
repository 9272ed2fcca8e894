//! Failures as DeepStack's clients understand them: 400 for whatever is wrong with the frame or a
//! field, 401 for the key, 404 for a model that is not there, 500 for one that has no answer in time.
//! Statuses that DeepStack has nothing for (429, 503) stay: they say when to come again.

use axum::http::StatusCode;

use crate::api::problem::ProblemKind;

const ROUTES: &str = "/v1/vision/";

/// Whether DeepStack's clients ask at this path.
pub(in crate::api) fn speaks_at(path: &str) -> bool {
    path.starts_with(ROUTES)
}

/// The status of a kind of problem at such a path.
pub(in crate::api) fn status_of(kind: ProblemKind) -> StatusCode {
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

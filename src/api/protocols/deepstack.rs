//! The DeepStack API, for clients such as Home Assistant and Blue Iris. Requests and responses
//! follow DeepStack's server (Go, `server/server.go`) and its clients `deepstack-python` and
//! `deepstack-sdk`.
//!
//! Failures in the form that DeepStack's clients expect: 400 for any fault of the frame or of a
//! field, 500 for a deadline that has passed, and `success: false` in the body. Statuses without a
//! counterpart in DeepStack (429, 503) stay, because they come with `Retry-After`.

mod answer;
mod form;
pub(in crate::api) mod status;

use std::sync::Arc;

use axum::{
    Json, Router,
    extract::{Path, State},
    http::{Method, StatusCode, Uri},
    middleware::map_response,
    response::Response,
    routing::any,
};
use lookdown_calibration::CalibrationId;
use tower_http::catch_panic::CatchPanicLayer;

use crate::api::{
    ApiState,
    detect::run::run_detection,
    http::{
        envelope,
        problem::{Problem, ProblemKind},
    },
    openapi::{CalibratedDetectionQuery, DetectionQuery},
    require_scope::RequireRead,
};

use answer::{DeepStackAnswer, DeepStackModels};
use form::{DeepStackForm, DeepStackUpload};

/// Detect persons (DeepStack)
///
/// Without a calibration, the lens circle is detected in the frame. An ideal 180° equidistant lens
/// that points straight down is assumed. Unknown fields are ignored. The query may have the
/// parameters of `POST /detect`, such as `profile` and `camera`; unknown ones are refused.
#[utoipa::path(
    post, path = "/v1/vision/detection", tag = "deepstack", operation_id = "detect_as_deepstack",
    params(DetectionQuery),
    request_body(content = DeepStackForm, content_type = "multipart/form-data"),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The persons found, possibly none.", body = DeepStackAnswer),
    )
)]
pub(in crate::api) async fn detect_as_deepstack(
    State(state): State<ApiState>,
    upload: DeepStackUpload,
) -> Result<Json<DeepStackAnswer>, Problem> {
    answer(&state, upload, None).await
}

/// Detect persons with a calibration (DeepStack)
///
/// The calibration ID replaces the name of DeepStack's custom model.
#[utoipa::path(
    post, path = "/v1/vision/custom/{calibration}", tag = "deepstack",
    operation_id = "detect_as_deepstack_with",
    params(
        ("calibration" = String, Path, description = "The calibration's ID."),
        CalibratedDetectionQuery,
    ),
    request_body(content = DeepStackForm, content_type = "multipart/form-data"),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The persons found, possibly none.", body = DeepStackAnswer),
    )
)]
pub(in crate::api) async fn detect_as_deepstack_with(
    State(state): State<ApiState>,
    Path(calibration): Path<String>,
    upload: DeepStackUpload,
) -> Result<Json<DeepStackAnswer>, Problem> {
    // A name that is not a valid ID is reported as an unknown model.
    let calibration: CalibrationId = calibration
        .parse()
        .map_err(|error| Problem::new(ProblemKind::UnknownCalibration, format!("{error}")))?;
    answer(&state, upload, Some(calibration)).await
}

async fn answer(
    state: &ApiState,
    sent: DeepStackUpload,
    calibration: Option<CalibrationId>,
) -> Result<Json<DeepStackAnswer>, Problem> {
    let context = Arc::clone(&sent.upload.context);
    context.note_upload(sent.upload.arrived);
    let job = sent.job(state, calibration.as_ref().map(CalibrationId::as_str))?;
    let answered = run_detection(state, &context, job, |found| {
        Ok(DeepStackAnswer::from(found.report))
    });
    Ok(Json(answered.await?.answer))
}

/// List calibrations (DeepStack)
///
/// The original DeepStack has no such route. Its successors have it, and Blue Iris calls it.
#[utoipa::path(
    post, path = "/v1/vision/custom/list", tag = "deepstack", operation_id = "list_as_deepstack",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "The IDs of the calibrations in use.", body = DeepStackModels),
    )
)]
pub(in crate::api) async fn list_as_deepstack(
    State(state): State<ApiState>,
    _reader: RequireRead,
) -> Json<DeepStackModels> {
    Json(state.calibrations.rows().into_iter().collect())
}

/// Get the calibrations (DeepStack)
///
/// The same as with `POST`, for clients of CodeProject.AI.
#[utoipa::path(
    get, path = "/v1/vision/custom/list", tag = "deepstack", operation_id = "get_list_as_deepstack",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "The IDs of the calibrations in use.", body = DeepStackModels),
    )
)]
pub(in crate::api) async fn get_list_as_deepstack(
    state: State<ApiState>,
    reader: RequireRead,
) -> Json<DeepStackModels> {
    list_as_deepstack(state, reader).await
}

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
        let status = status_of(problem.kind);
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

//! The routes of DeepStack, as its clients know them: Home Assistant, Blue Iris and the like point
//! here and find people in fisheye frames. What they send and read is what DeepStack's server (Go,
//! `server/server.go`) and its clients `deepstack-python` and `deepstack-sdk` do.

mod answer;
mod failures;
mod form;

use axum::{
    Extension, Json,
    extract::{Path, State},
};

use self::{
    answer::{DeepStackAnswer, DeepStackModels},
    form::{DeepStackForm, DeepStackUpload},
};
use super::{
    ApiState,
    access::Reader,
    find::find,
    problem::{Problem, ProblemKind},
    request_id::RequestId,
};
use crate::{calibration::CalibrationId, telemetry::RequestTrace};

pub(super) use failures::with_failures;

/// Find the persons in a frame, as DeepStack answers.
///
/// Without a calibration the lens circle is found in the frame and an ideal 180° equidistant lens
/// that looks straight down is assumed. Further fields are passed over.
#[utoipa::path(
    post, path = "/v1/vision/detection", tag = "deepstack", operation_id = "detect_as_deepstack",
    request_body(content = DeepStackForm, content_type = "multipart/form-data"),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The persons found, possibly none.", body = DeepStackAnswer),
    )
)]
pub(super) async fn detect_as_deepstack(
    State(state): State<ApiState>,
    Extension(request_id): Extension<RequestId>,
    Extension(trace): Extension<RequestTrace>,
    upload: DeepStackUpload,
) -> Result<Json<DeepStackAnswer>, Problem> {
    answer(&state, &trace, upload, None, &request_id).await
}

/// Find the persons in a frame of a calibrated camera, as DeepStack answers.
///
/// The calibration takes the place of DeepStack's custom model.
#[utoipa::path(
    post, path = "/v1/vision/custom/{calibration}", tag = "deepstack",
    operation_id = "detect_as_deepstack_with",
    params(("calibration" = String, Path, description = "The calibration's ID.")),
    request_body(content = DeepStackForm, content_type = "multipart/form-data"),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The persons found, possibly none.", body = DeepStackAnswer),
    )
)]
pub(super) async fn detect_as_deepstack_with(
    State(state): State<ApiState>,
    Path(calibration): Path<String>,
    Extension(request_id): Extension<RequestId>,
    Extension(trace): Extension<RequestTrace>,
    upload: DeepStackUpload,
) -> Result<Json<DeepStackAnswer>, Problem> {
    // What is no ID is a model that is not there.
    let calibration: CalibrationId = calibration
        .parse()
        .map_err(|error| Problem::new(ProblemKind::UnknownCalibration, format!("{error}")))?;
    answer(&state, &trace, upload, Some(calibration), &request_id).await
}

async fn answer(
    state: &ApiState,
    trace: &RequestTrace,
    DeepStackUpload(upload): DeepStackUpload,
    calibration: Option<CalibrationId>,
    request_id: &RequestId,
) -> Result<Json<DeepStackAnswer>, Problem> {
    let limit = upload.deadline;
    trace.stage("upload", limit.began().into_std(), upload.arrived);
    let job = form::job(upload, calibration, request_id)?;
    let written = find(state, trace, limit, job, |found| {
        Ok(DeepStackAnswer::from(found.report))
    });
    let (_, answer) = written.await?;
    Ok(Json(answer))
}

/// Which calibrations can be named, as DeepStack's custom models are listed.
///
/// DeepStack itself has no such route, but what has taken its place does, and Blue Iris asks for it.
#[utoipa::path(
    post, path = "/v1/vision/custom/list", tag = "deepstack", operation_id = "list_as_deepstack",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "The IDs of the calibrations that serve.", body = DeepStackModels),
    )
)]
pub(super) async fn list_as_deepstack(
    State(state): State<ApiState>,
    _reader: Reader,
) -> Json<DeepStackModels> {
    Json(state.calibrations.rows().into_iter().collect())
}

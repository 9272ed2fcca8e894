//! Asking a model.

use axum::{
    Extension,
    extract::{Path, State},
    response::IntoResponse,
};

use super::{
    Asked,
    answer::InferAnswer,
    detector,
    document::{InferRequestBody, InferResponseBody},
    persons,
    request::InferRequest,
};
use crate::{
    api::{ApiState, openapi::RawBytes, problem::Problem, request_id::RequestId, upload::Arrival},
    telemetry::RequestTrace,
};

/// Find persons as clients of the Open Inference Protocol ask.
///
/// `lookdown` takes `image` (`BYTES`, `[1]`): an encoded frame, base64 in JSON, as it is behind it. It
/// answers with `boxes` (`[persons, 4]`), `scores`, `oriented_boxes` (`[persons, 5]`), `views` and
/// `report`; the parameters of `/detect` are parameters of the request. A detector takes `views` (`FP32` or
/// `UINT8`, `[views, 3, height, width]`, pixels 0 to 255) and answers with `boxes`
/// (`[views, candidates, 4]`) and `scores` (`[views, candidates]`), filled up with zeros.
#[utoipa::path(
    post, path = "/v2/models/{name}/infer", tag = "inference", operation_id = "infer_with_model",
    params(
        ("name" = String, Path, description = "`lookdown`, or the name of a detector."),
        ("Inference-Header-Content-Length" = Option<u32>, Header, nullable = false,
         description = "Where tensors follow as bytes: the length of the JSON before them."),
    ),
    request_body(
        description = "JSON, or JSON with the bytes of tensors behind it.",
        content((InferRequestBody = "application/json"), (inline(RawBytes) = "application/octet-stream"))
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The outputs.",
         content((InferResponseBody = "application/json"), ("application/octet-stream"))),
    )
)]
pub(in crate::api) async fn infer(
    State(state): State<ApiState>,
    Extension(request_id): Extension<RequestId>,
    Extension(trace): Extension<RequestTrace>,
    Path(name): Path<String>,
    arrival: Arrival,
) -> Result<impl IntoResponse, Problem> {
    let asked = Asked::find(&state, &name, None)?;
    answered(&state, &request_id, &trace, asked, arrival).await
}

/// Find persons with this version of a model.
///
/// As without a version.
#[utoipa::path(
    post, path = "/v2/models/{name}/versions/{version}/infer", tag = "inference",
    operation_id = "infer_with_model_version",
    params(
        ("name" = String, Path, description = "`lookdown`, or the name of a detector."),
        ("version" = String, Path, description = "Its one version, as its metadata tells it."),
        ("Inference-Header-Content-Length" = Option<u32>, Header, nullable = false,
         description = "Where tensors follow as bytes: the length of the JSON before them."),
    ),
    request_body(
        description = "JSON, or JSON with the bytes of tensors behind it.",
        content((InferRequestBody = "application/json"), (inline(RawBytes) = "application/octet-stream"))
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The outputs.",
         content((InferResponseBody = "application/json"), ("application/octet-stream"))),
    )
)]
pub(in crate::api) async fn infer_version(
    State(state): State<ApiState>,
    Extension(request_id): Extension<RequestId>,
    Extension(trace): Extension<RequestTrace>,
    Path((name, version)): Path<(String, String)>,
    arrival: Arrival,
) -> Result<impl IntoResponse, Problem> {
    let asked = Asked::find(&state, &name, Some(&version))?;
    answered(&state, &request_id, &trace, asked, arrival).await
}

async fn answered(
    state: &ApiState,
    request_id: &RequestId,
    trace: &RequestTrace,
    asked: Asked,
    arrival: Arrival,
) -> Result<InferAnswer, Problem> {
    trace.stage(
        "upload",
        arrival.deadline.began().into_std(),
        arrival.arrived,
    );
    let (headers, body) = (arrival.parts.headers, arrival.body.into_bytes());
    let budget = state.uploads.clone();
    let read = move || InferRequest::read(&headers, &body, &budget);
    let read = arrival.deadline.blocking(read).await?;
    let times = (arrival.deadline, arrival.received_at, arrival.arrived);
    match asked {
        Asked::Frames => persons::infer(state, request_id, trace, read, times).await,
        Asked::Views(model) => detector::infer(state, trace, model, read, times).await,
    }
}

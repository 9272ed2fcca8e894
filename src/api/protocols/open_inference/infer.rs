//! Inference requests.

use axum::{extract::State, response::IntoResponse};

use super::{
    content_encoding::decompressed,
    detector,
    document::{InferRequestBody, InferResponseBody},
    persons::{self, ArrivalTimes},
    request::InferRequest,
    requested_model::{ModelAddress, RequestedModel},
};
use crate::api::{
    ApiState,
    detect::upload::ReceivedRequest,
    http::{problem::Problem, rate_limit::RequestTokens},
    openapi::RawBytes,
};

/// Run inference
///
/// `lookdown` accepts `image` (`BYTES`, `[frames]`): 1 to 16 encoded frames, base64 in JSON, or
/// unchanged bytes after it. It returns `boxes` (`[persons, 4]`), `scores`, `oriented_boxes`
/// (`[persons, 5]`) and `views` for the persons of all frames in order, and `counts` (persons) and
/// `report` for each frame. The frames are processed one after another, each within the limits of
/// a request. The parameters of `/detect` are parameters of the request. The body may be compressed
/// (`Content-Encoding: gzip` or `deflate`). A
/// detector accepts `views` (`FP32` or `UINT8`, `[views, 3, height, width]`, pixels 0 to 255) and
/// returns `boxes` (`[views, candidates, 4]`) and `scores` (`[views, candidates]`), padded with
/// zeros.
#[utoipa::path(
    post, path = "/v2/models/{name}/infer", tag = "inference", operation_id = "infer_with_model",
    params(
        ("name" = String, Path, description = "`lookdown`, or the name of a detector."),
        ("Inference-Header-Content-Length" = Option<u32>, Header, nullable = false,
         description = "The length of the JSON, if tensors follow it as bytes."),
    ),
    request_body(
        description = "JSON, or JSON followed by the bytes of tensors.",
        content((InferRequestBody = "application/json"), (inline(RawBytes) = "application/octet-stream"))
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The outputs.",
         content((InferResponseBody = "application/json"), (inline(RawBytes) = "application/octet-stream"))),
    )
)]
pub(in crate::api) async fn infer(
    State(state): State<ApiState>,
    address: ModelAddress,
    arrival: ReceivedRequest,
) -> Result<impl IntoResponse, Problem> {
    let model = RequestedModel::find(&state, &address)?;
    let context = arrival.context;
    context.note_upload(arrival.arrived);
    let tokens = arrival.parts.extensions.get::<RequestTokens>().cloned();
    let (headers, body) = (arrival.parts.headers, arrival.body.into_bytes());
    let budget = state.uploads.of(&context.caller.client);
    let max_bytes = state.options.max_body_bytes;
    let read = move || {
        let body = decompressed(&headers, body, max_bytes, &budget)?;
        InferRequest::read(&headers, &body, &budget)
    };
    let read = context.deadline.blocking(read).await?;
    let times = ArrivalTimes {
        received_at: arrival.received_at,
        arrived: arrival.arrived,
    };
    match model {
        RequestedModel::Frames => persons::infer(&state, &context, read, times, tokens).await,
        RequestedModel::Views(model) => {
            detector::infer(&state, &context, model, read, times.arrived).await
        }
    }
}

/// Run inference with a model version
///
/// Equivalent to the route without a version.
#[utoipa::path(
    post, path = "/v2/models/{name}/versions/{version}/infer", tag = "inference",
    operation_id = "infer_with_model_version",
    params(
        ("name" = String, Path, description = "`lookdown`, or the name of a detector."),
        ("version" = String, Path, description = "The version in the metadata of the model."),
        ("Inference-Header-Content-Length" = Option<u32>, Header, nullable = false,
         description = "The length of the JSON, if tensors follow it as bytes."),
    ),
    request_body(
        description = "JSON, or JSON followed by the bytes of tensors.",
        content((InferRequestBody = "application/json"), (inline(RawBytes) = "application/octet-stream"))
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The outputs.",
         content((InferResponseBody = "application/json"), (inline(RawBytes) = "application/octet-stream"))),
    )
)]
pub(in crate::api) async fn infer_version(
    state: State<ApiState>,
    address: ModelAddress,
    arrival: ReceivedRequest,
) -> Result<impl IntoResponse, Problem> {
    infer(state, address, arrival).await
}

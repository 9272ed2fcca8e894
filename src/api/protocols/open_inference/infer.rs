//! Inference requests.

use axum::{
    extract::{Path, State},
    response::IntoResponse,
};

use super::{
    document::{InferRequestBody, InferResponseBody},
    own_metadata::require_frame_model,
    persons::{self, ArrivalTimes},
    request::{InferRequest, decompressed},
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
/// (`Content-Encoding: gzip` or `deflate`).
#[utoipa::path(
    post, path = "/v2/models/{name}/infer", tag = "inference", operation_id = "infer_with_model",
    params(
        ("name" = String, Path, description = "`lookdown`."),
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
    Path(name): Path<String>,
    arrival: ReceivedRequest,
) -> Result<impl IntoResponse, Problem> {
    require_frame_model(&name)?;
    let context = arrival.context;
    context.note_upload(arrival.arrived);
    let tokens = arrival.parts.extensions.get::<RequestTokens>().cloned();
    let (headers, body) = (arrival.parts.headers, arrival.body.into_bytes());
    let budget = state.uploads.for_client(&context.caller.client);
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
    persons::infer(&state, &context, read, times, tokens).await
}

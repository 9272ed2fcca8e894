//! Inference requests.
//!
//! Inference requests and responses in the OpenAPI document. `request` reads the requests,
//! `answer` writes the responses.

use axum::{
    extract::{Path, State},
    response::IntoResponse,
};
use lookdown_detect::parameters::Interface;
use utoipa::{
    PartialSchema, ToSchema,
    openapi::{
        ObjectBuilder, RefOr, Schema,
        schema::{AdditionalProperties, Object, Type},
    },
};

use super::{
    persons::{self, ArrivalTimes, require_frame_model},
    request::{InferRequest, decompressed},
};
use crate::api::{
    ApiState,
    detect::upload::ReceivedRequest,
    http::{problem::Problem, rate_limit::RequestTokens},
    openapi::{RawBytes, fields},
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
    let max_bytes = state.options.settings.server.max_body_bytes;
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

/// An inference request with its tensors. A tensor whose bytes follow the JSON has the parameter
/// `binary_data_size` instead of `data`.
#[derive(ToSchema)]
#[schema(example = json!({
    "id": "17",
    "parameters": {"calibration": "lobby", "profile": "fast"},
    "inputs": [{"name": "image", "datatype": "BYTES", "shape": [1], "data": ["/9j/4AAQ…"]}],
    "outputs": [{"name": "boxes"}, {"name": "scores"}]
}))]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "documents the JSON that request reads")]
struct InferRequestBody {
    /// The ID of the request; the response repeats it.
    #[schema(max_length = 256)]
    id: Option<String>,
    /// The parameters of `/detect` and of the protocol.
    #[schema(nullable = false)]
    parameters: Option<InferParameters>,
    /// The input of the model.
    #[schema(max_items = 16)]
    inputs: Vec<InferInput>,
    /// The requested outputs; all of the model's by default.
    #[schema(max_items = 16)]
    outputs: Option<Vec<InferRequestedOutput>>,
}

/// An input tensor.
#[derive(ToSchema)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "documents the JSON that request reads")]
struct InferInput {
    /// The name.
    name: String,
    /// The size of each axis.
    #[schema(max_items = 16)]
    shape: Vec<u32>,
    /// `BYTES`.
    #[schema(example = "BYTES")]
    datatype: String,
    /// The elements in Base64. The lists may be nested like the shape.
    data: Vec<serde_json::Value>,
}

/// A requested output.
#[derive(ToSchema)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "documents the JSON that request reads")]
struct InferRequestedOutput {
    /// The name.
    name: String,
    /// The parameters of the output.
    #[schema(nullable = false)]
    parameters: Option<InferOutputParameters>,
}

/// The parameters of a requested output.
#[derive(ToSchema)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "documents the JSON that request reads")]
struct InferOutputParameters {
    /// `true` to send the output as bytes after the JSON.
    binary_data: Option<bool>,
}

/// The parameters of a request.
struct InferParameters;

impl ToSchema for InferParameters {}

impl PartialSchema for InferParameters {
    /// Returns the schema of the parameters of `/detect` and of the protocol.
    fn schema() -> RefOr<Schema> {
        let description = "Parameters of `/detect`, and of the protocol.";
        let timeout = ObjectBuilder::new()
            .schema_type(Type::Integer)
            .minimum(Some(1))
            .maximum(Some(600_000_000))
            .description(Some(
                "`timeout_millis` in microseconds, as the protocol has it.",
            ));
        let binary = Object::with_type(Type::Boolean);
        let parameters = ObjectBuilder::new()
            .description(Some(description))
            .property("timeout", timeout)
            .property("binary_data_output", binary)
            .additional_properties(Some(AdditionalProperties::<Schema>::FreeForm(false)));
        let parameters = fields(Interface::FrameModel).fold(parameters, |object, (name, field)| {
            object.property(name, field)
        });
        parameters.into()
    }
}

/// An inference response.
#[derive(ToSchema)]
#[schema(example = json!({
    "model_name": "lookdown", "model_version": "1", "id": "17",
    "outputs": [
        {"name": "boxes", "datatype": "FP32", "shape": [1, 4], "data": [1102.41, 700.08, 1341.77, 842.6]},
        {"name": "scores", "datatype": "FP32", "shape": [1], "data": [0.8731]}
    ]
}))]
#[expect(dead_code, reason = "documents the output of answer")]
struct InferResponseBody {
    /// The name of the model.
    model_name: String,
    /// The version of the model.
    model_version: String,
    /// The ID of the request, if it had one.
    #[schema(nullable = false)]
    id: Option<String>,
    /// The outputs, in the order of the model's metadata.
    outputs: Vec<InferOutput>,
}

/// An output tensor.
#[derive(ToSchema)]
#[expect(dead_code, reason = "documents the output of answer")]
struct InferOutput {
    /// The name.
    name: String,
    /// The datatype.
    #[schema(example = "FP32")]
    datatype: String,
    /// The size of each axis.
    shape: Vec<u32>,
    /// The parameters of an output that is sent as bytes after the JSON.
    #[schema(nullable = false)]
    parameters: Option<BinarySize>,
    /// The values otherwise, flat and row-major.
    #[schema(nullable = false)]
    data: Option<Vec<serde_json::Value>>,
}

/// Parameters of an output that is sent as bytes.
#[derive(ToSchema)]
#[expect(dead_code, reason = "documents the output of answer")]
struct BinarySize {
    /// Number of bytes of this output after the JSON, in the order of the outputs.
    binary_data_size: usize,
}

//! Requests and answers as they are described. `request_head` reads the ones, `answer` writes the others.

use utoipa::{
    PartialSchema, ToSchema,
    openapi::{
        ObjectBuilder, RefOr, Schema,
        schema::{AdditionalProperties, Object, Type},
    },
};

use super::answer::BinarySize;
use crate::{api::openapi::fields, pipeline::Interface};

/// A request to infer, its tensors in it. Where they come as bytes behind it, `binary_data_size` is a
/// parameter of theirs instead of `data`.
#[derive(ToSchema)]
#[schema(example = json!({
    "id": "17",
    "parameters": {"calibration": "lobby", "profile": "fast"},
    "inputs": [{"name": "image", "datatype": "BYTES", "shape": [1], "data": ["/9j/4AAQ…"]}],
    "outputs": [{"name": "boxes"}, {"name": "scores"}]
}))]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "describes what request_head reads")]
pub(in crate::api) struct InferRequestBody {
    /// Is in the answer as well.
    #[schema(max_length = 256)]
    id: Option<String>,
    /// The parameters of `/detect` and of the protocol.
    #[schema(nullable = false)]
    parameters: Option<InferParameters>,
    /// The one that the model takes.
    #[schema(max_items = 16)]
    inputs: Vec<InferInput>,
    /// Those wanted; all of the model's when there are none.
    #[schema(max_items = 16)]
    outputs: Option<Vec<InferRequestedOutput>>,
}

/// A tensor that is sent.
#[derive(ToSchema)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "describes what request_head reads")]
struct InferInput {
    /// Its name.
    name: String,
    /// The size of each axis.
    #[schema(max_items = 16)]
    shape: Vec<u32>,
    /// `BYTES`, `FP32` or `UINT8`.
    #[schema(example = "BYTES")]
    datatype: String,
    /// Base64 for `BYTES`, numbers otherwise, row-major; lists may be nested as the shape is.
    data: Vec<serde_json::Value>,
}

/// An output that is wanted.
#[derive(ToSchema)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "describes what request_head reads")]
struct InferRequestedOutput {
    /// Its name.
    name: String,
    /// How.
    #[schema(nullable = false)]
    parameters: Option<InferOutputParameters>,
}

/// How an output is wanted.
#[derive(ToSchema)]
#[serde(deny_unknown_fields)]
#[expect(dead_code, reason = "describes what request_head reads")]
struct InferOutputParameters {
    /// As bytes behind the JSON.
    binary_data: Option<bool>,
}

/// The parameters of a request.
struct InferParameters;

impl ToSchema for InferParameters {
    fn schemas(_: &mut Vec<(String, RefOr<Schema>)>) {}
}

impl PartialSchema for InferParameters {
    /// What the pipeline reads of the parameters of `/detect`, and the protocol's own.
    fn schema() -> RefOr<Schema> {
        let description = "Parameters of `/detect`, and of the protocol. Detectors take the protocol's \
                           and `timeout_millis`.";
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

/// What a model answers.
#[derive(ToSchema)]
#[schema(example = json!({
    "model_name": "lookdown", "model_version": "1", "id": "17",
    "outputs": [
        {"name": "boxes", "datatype": "FP32", "shape": [1, 4], "data": [1102.41, 700.08, 1341.77, 842.6]},
        {"name": "scores", "datatype": "FP32", "shape": [1], "data": [0.8731]}
    ]
}))]
#[expect(dead_code, reason = "describes what answer writes")]
pub(in crate::api) struct InferResponseBody {
    /// The model.
    model_name: String,
    /// Its version.
    model_version: String,
    /// The request's, if it had one.
    #[schema(nullable = false)]
    id: Option<String>,
    /// The outputs, in the order of the model's metadata.
    outputs: Vec<InferOutput>,
}

/// A tensor that is answered.
#[derive(ToSchema)]
#[expect(dead_code, reason = "describes what answer writes")]
struct InferOutput {
    /// Its name.
    name: String,
    /// Its datatype.
    #[schema(example = "FP32")]
    datatype: String,
    /// The size of each axis.
    shape: Vec<u32>,
    /// Where it comes as bytes behind the JSON.
    #[schema(nullable = false)]
    parameters: Option<BinarySize>,
    /// Its values otherwise, flat and row-major.
    #[schema(nullable = false)]
    data: Option<Vec<serde_json::Value>>,
}

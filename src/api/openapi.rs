//! The OpenAPI document. Each route describes its own parameters and responses. This module adds
//! the common parts.

mod parameters;

pub(super) use parameters::{
    AnnotationQuery, CalibratedDetectionQuery, DetectForm, DetectQuery, DetectionQuery, RawBytes,
    fields,
};

use indexmap::IndexMap;
use lookdown_http::openapi::Keys;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use utoipa::openapi::{self, OpenApi, RefOr, path::Operation};

use super::http::problem::ProblemBody;

#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "Lookdown",
        description = "Detects persons in the frames of ceiling fisheye cameras. Every failure is a \
                       problem document (RFC 9457).",
        contact(name = "The Lookdown authors")
    ),
    external_docs(url = "/problems", description = "Problems and their remedies"),
    servers((url = "/", description = "This server")),
    tags(
        (name = "detection", description = "Frames in, persons out."),
        (name = "deepstack", description = "Detection for clients of DeepStack, such as Home Assistant and Blue Iris."),
        (name = "inference", description = "Detection for clients of the Open Inference Protocol (KServe V2)."),
        (name = "results", description = "Stored reports and images, for dashboards. In memory or in a shared Redis, within limits."),
        (name = "calibrations", description = "Calibrations of the cameras. Changes need the scope `admin`."),
        (name = "cameras", description = "Cameras of `lookdown run`. Changes need the scope `admin`."),
        (name = "operation", description = "Health checks, metrics and documentation."),
    ),
    components(schemas(ProblemBody)),
    modifiers(&Keys)
)]
pub(super) struct Common;

/// Adds the failures, and the operations that need no key, to the document of the routes.
pub(super) fn complete(mut document: openapi::OpenApi) -> openapi::OpenApi {
    parameters::add_choices(document.components.get_or_insert_default());
    add_examples(&mut document);
    lookdown_http::openapi::complete(&mut document);
    document
}

const FORM: &str = "multipart/form-data";
const JSON: &str = "application/json";
const EVENTS: &str = "text/event-stream";

/// The OpenAPI document as it is published: the form is the first media type of a body.
#[derive(Debug, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Document(Node);

#[derive(Debug, Serialize, Deserialize)]
#[serde(untagged)]
enum Node {
    Object(IndexMap<String, Node>),
    Array(Vec<Node>),
    Scalar(Value),
}

impl Document {
    /// Orders the media types of a document.
    ///
    /// # Errors
    /// A document that is not JSON.
    pub fn from_document(document: &OpenApi) -> serde_json::Result<Self> {
        let mut root: Node = serde_json::from_str(&document.to_json()?)?;
        root.put_forms_first();
        Ok(Self(root))
    }
}

impl Node {
    fn put_forms_first(&mut self) {
        match self {
            Self::Object(fields) => {
                if let Some(index) = fields.get_index_of(FORM) {
                    fields.move_index(index, 0);
                }
                fields.values_mut().for_each(Self::put_forms_first);
            }
            Self::Array(items) => items.iter_mut().for_each(Self::put_forms_first),
            Self::Scalar(_) => {}
        }
    }
}

/// The method and path of an operation, the media type of a body of it, and an example of that.
type Row = (&'static str, &'static str, &'static str, Value);

/// Adds examples for bodies whose schemas have none: files, forms and streams.
fn add_examples(document: &mut OpenApi) {
    for (method, path, media_type, example) in requests() {
        if let Some(operation) = operation(document, method, path)
            && let Some(RefOr::T(body)) = &mut operation.request_body
            && let Some(RefOr::T(content)) = body.content.get_mut(media_type)
        {
            content.example = Some(example);
        }
    }
    for (method, path, media_type, example) in responses() {
        if let Some(operation) = operation(document, method, path)
            && let Some(RefOr::T(response)) = operation.responses.responses.get_mut("200")
            && let Some(RefOr::T(content)) = response.content.get_mut(media_type)
        {
            content.example = Some(example);
        }
    }
}

fn requests() -> Vec<Row> {
    let frame = "the bytes of frame.jpg";
    vec![
        ("put", "/calibrations/{id}", JSON, calibration()),
        ("post", "/calibrations/{id}/views", JSON, calibration()),
        (
            "post",
            "/detect",
            FORM,
            json!({"img": frame, "calibration": "lobby"}),
        ),
        ("post", "/v1/vision/detection", FORM, deepstack(frame)),
        (
            "post",
            "/v1/vision/custom/{calibration}",
            FORM,
            deepstack(frame),
        ),
        ("post", "/v2/models/{name}/infer", JSON, infer_request()),
    ]
}

/// The request of a frame, whose bytes JSON carries in Base64.
fn infer_request() -> Value {
    json!({
        "id": "17",
        "parameters": {"calibration": "lobby", "profile": "fast"},
        "inputs": [{"name": "image", "datatype": "BYTES", "shape": [1], "data": ["/9j/4AAQSkZJRg…"]}]
    })
}

fn responses() -> Vec<Row> {
    let events =
        "id: 1763717400412345\ndata: {\"request_id\":\"0197a3c5-…\",\"camera\":\"lobby\"}\n\n";
    vec![
        ("get", "/calibrations/{id}", JSON, calibration()),
        ("get", "/events", EVENTS, json!(events)),
        ("get", "/results/{camera}/events", EVENTS, json!(events)),
        (
            "get",
            "/v2",
            JSON,
            json!({
                "name": "lookdown", "version": env!("CARGO_PKG_VERSION"),
                "extensions": ["binary_tensor_data"], "follow": false
            }),
        ),
        ("get", "/v2/health/live", JSON, json!({"live": true})),
        ("get", "/v2/health/ready", JSON, json!({"ready": true})),
        ("get", "/v2/models/{name}/ready", JSON, model_ready()),
    ]
}

fn operation<'a>(document: &'a mut OpenApi, method: &str, path: &str) -> Option<&'a mut Operation> {
    let item = document.paths.paths.get_mut(path)?;
    match method {
        "get" => item.get.as_mut(),
        "put" => item.put.as_mut(),
        _ => item.post.as_mut(),
    }
}

fn calibration() -> Value {
    json!({
        "id": "lobby",
        "image": {"width": 1680, "height": 1680},
        "lens": {
            "model": "equidistant", "focal": 534.76, "cx": 839.5, "cy": 839.5, "max_theta": 1.5
        },
        "mount": {"world_up": [0, 0, -1], "height_m": 2.8},
        "zones": [{"name": "till", "floor_m": [[1, -0.5], [2.5, -0.5], [2.5, 1], [1, 1]]}],
        "detect": {"profile": "fast", "score_threshold": 0.4}
    })
}

fn deepstack(frame: &str) -> Value {
    json!({"image": frame, "min_confidence": 0.4})
}

fn model_ready() -> Value {
    json!({"name": "lookdown", "ready": true})
}

#[cfg(test)]
mod tests {
    use lookdown_calibration::CalibrationFile;

    use super::*;

    #[test]
    fn the_example_calibration_is_accepted() {
        let content = calibration().to_string();
        let file = CalibrationFile::parse(content.as_bytes()).unwrap();
        let (_, checked) = file.calibrations("lobby", content.as_bytes()).remove(0);
        assert!(checked.is_ok());
    }

    #[test]
    fn every_example_has_a_place_in_the_document() {
        let document = crate::api::openapi_document(None).unwrap();
        let text = serde_json::to_string(&document).unwrap();
        assert_eq!(text.matches("the bytes of frame.jpg").count(), 3);
        assert_eq!(text.matches("\"focal\":534.76").count(), 3);
        assert_eq!(text.matches("data: {\\\"request_id").count(), 2);
    }
}

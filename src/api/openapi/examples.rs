//! Examples in the OpenAPI document, for bodies whose schemas have none: files, forms and streams.

use serde_json::{Value, json};
use utoipa::openapi::{OpenApi, RefOr, path::Operation};

const JSON: &str = "application/json";
const FORM: &str = "multipart/form-data";
const EVENTS: &str = "text/event-stream";

/// The method and path of an operation, the media type of a body of it, and an example of that.
type Row = (&'static str, &'static str, &'static str, Value);

/// Adds the examples.
pub(super) fn add(document: &mut OpenApi) {
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

//! Examples in the OpenAPI document, for bodies whose schemas have none: files, forms and streams.

use serde_json::{Value, json};
use utoipa::openapi::{
    OpenApi, RefOr,
    path::{Operation, PathItem},
};

const JSON: &str = "application/json";
const FORM: &str = "multipart/form-data";
const EVENTS: &str = "text/event-stream";

/// The place of a body.
#[derive(Clone, Copy)]
enum Body {
    Request,
    Response,
}

/// Adds the examples.
pub(super) fn add(document: &mut OpenApi) {
    let frame = "the bytes of frame.jpg";
    let events =
        "id: 1763717400412345\ndata: {\"request_id\":\"0197a3c5-…\",\"camera\":\"lobby\"}\n\n";
    for (method, path, body, media_type, example) in [
        (
            "get",
            "/calibrations/{id}",
            Body::Response,
            JSON,
            calibration(),
        ),
        (
            "put",
            "/calibrations/{id}",
            Body::Request,
            JSON,
            calibration(),
        ),
        (
            "post",
            "/calibrations/{id}/views",
            Body::Request,
            JSON,
            calibration(),
        ),
        (
            "post",
            "/detect",
            Body::Request,
            FORM,
            json!({"img": frame, "calibration": "lobby"}),
        ),
        (
            "post",
            "/v1/vision/detection",
            Body::Request,
            FORM,
            deepstack(frame),
        ),
        (
            "post",
            "/v1/vision/custom/{calibration}",
            Body::Request,
            FORM,
            deepstack(frame),
        ),
        ("get", "/events", Body::Response, EVENTS, json!(events)),
        (
            "get",
            "/results/{camera}/events",
            Body::Response,
            EVENTS,
            json!(events),
        ),
        (
            "get",
            "/v2",
            Body::Response,
            JSON,
            json!({
                "name": "lookdown", "version": env!("CARGO_PKG_VERSION"),
                "extensions": ["binary_tensor_data", "model_repository"]
            }),
        ),
        (
            "post",
            "/v2/repository/index",
            Body::Request,
            JSON,
            json!({"ready": true}),
        ),
        (
            "post",
            "/v2/repository/models/{name}/load",
            Body::Request,
            JSON,
            json!({}),
        ),
        (
            "post",
            "/v2/repository/models/{name}/unload",
            Body::Request,
            JSON,
            json!({}),
        ),
    ] {
        let item = document.paths.paths.get_mut(path);
        let operation = item.and_then(|item| operation(item, method));
        if let Some(operation) = operation {
            set(operation, body, media_type, &example);
        }
    }
}

fn operation<'a>(item: &'a mut PathItem, method: &str) -> Option<&'a mut Operation> {
    match method {
        "get" => item.get.as_mut(),
        "put" => item.put.as_mut(),
        _ => item.post.as_mut(),
    }
}

fn set(operation: &mut Operation, body: Body, media_type: &str, example: &Value) {
    let content = match body {
        Body::Request => match &mut operation.request_body {
            Some(RefOr::T(body)) => body.content.get_mut(media_type),
            _ => None,
        },
        Body::Response => match operation.responses.responses.get_mut("200") {
            Some(RefOr::T(response)) => response.content.get_mut(media_type),
            _ => None,
        },
    };
    if let Some(RefOr::T(content)) = content {
        content.example = Some(example.clone());
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::CalibrationFile;

    #[test]
    fn the_example_calibration_is_accepted() {
        let content = calibration().to_string();
        let file = CalibrationFile::parse(content.as_bytes()).unwrap();
        let (_, checked) = file.calibrations("lobby", content.as_bytes()).remove(0);
        assert!(checked.is_ok());
    }

    #[test]
    fn every_example_has_a_place_in_the_document() {
        let document = crate::api::openapi_document();
        let text = document.to_json().unwrap();
        assert_eq!(text.matches("the bytes of frame.jpg").count(), 3);
        assert_eq!(text.matches("\"focal\":534.76").count(), 3);
        assert_eq!(text.matches("data: {\\\"request_id").count(), 2);
    }
}

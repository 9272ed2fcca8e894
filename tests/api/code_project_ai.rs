//! The whole shape of each answer to a client of CodeProject.AI: names and types of all fields.
//!
//! Expected are the fields of its API reference ("Object Detection", "Server Ping", "Server Update
//! Available"), and `code` and `duration` of DeepStack's answers. Version objects and
//! `current` and `latest` are those of its server 2: written in camel case, and two objects more
//! than the reference names. The reference's `moduleName`, `executionProvider` and `canUseGPU`
//! describe modules, which Lookdown does not have.

use serde_json::{Map, Value};

use crate::service::{Answer, Service, form, frame};

/// Asserts the names and types of all fields.
#[track_caller]
fn assert_shape(value: &Value, expected: &[(&str, &str)]) {
    let fields = value.as_object().map(Map::iter).into_iter().flatten();
    let mut found: Vec<_> = fields
        .map(|(name, value)| (name.as_str(), type_of(value)))
        .collect();
    let mut expected = expected.to_vec();
    found.sort_unstable();
    expected.sort_unstable();
    assert_eq!(found, expected, "{value}");
}

fn type_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(number) if number.is_f64() => "float",
        Value::Number(_) => "integer",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    }
}

async fn detect(service: &Service, parts: &[(&str, &[u8])]) -> Answer {
    let mut request = form(parts);
    *request.uri_mut() = "/v1/vision/custom/lobby".parse().unwrap();
    service.send(request).await
}

#[tokio::test]
async fn detection_has_the_documented_shape() {
    let service = Service::start();
    let answer = detect(&service, &[("image", &frame())]).await.json();
    assert_shape(
        &answer,
        &[
            ("success", "boolean"),
            ("message", "string"),
            ("predictions", "array"),
            ("count", "integer"),
            ("command", "string"),
            ("moduleId", "string"),
            ("inferenceMs", "integer"),
            ("processMs", "integer"),
            ("analysisRoundTripMs", "integer"),
            ("code", "integer"),
            ("duration", "float"),
        ],
    );
    let predictions = answer["predictions"].as_array().unwrap();
    assert!(!predictions.is_empty());
    for prediction in predictions {
        assert_shape(
            prediction,
            &[
                ("label", "string"),
                ("confidence", "float"),
                ("x_min", "integer"),
                ("y_min", "integer"),
                ("x_max", "integer"),
                ("y_max", "integer"),
            ],
        );
    }
}

#[tokio::test]
async fn failures_have_the_documented_fields() {
    let service = Service::start();
    let answer = detect(&service, &[("min_confidence", b"0.4")]).await;
    assert_eq!(answer.status, 400);
    let answer = answer.json();
    assert_eq!(answer["success"], false);
    assert_eq!(type_of(&answer["error"]), "string");
}

#[tokio::test]
async fn pings_and_model_lists_have_the_documented_shape() {
    let service = Service::start();
    for path in ["/v1/status/ping", "/v1/server/status/ping"] {
        assert_shape(&service.get(path).await.json(), &[("success", "boolean")]);
    }
    let models = service.get("/v1/vision/custom/list").await.json();
    assert_shape(&models, &[("success", "boolean"), ("models", "array")]);
    assert_eq!(type_of(&models["models"][0]), "string");
}

#[tokio::test]
async fn update_status_has_the_documented_shape() {
    let service = Service::start();
    let answer = service.get("/v1/status/updateavailable").await.json();
    assert_shape(
        &answer,
        &[
            ("success", "boolean"),
            ("message", "string"),
            ("version", "object"),
            ("current", "object"),
            ("latest", "object"),
            ("updateAvailable", "boolean"),
        ],
    );
    for version in ["version", "current", "latest"] {
        let version = &answer[version];
        assert_shape(
            version,
            &[
                ("major", "integer"),
                ("minor", "integer"),
                ("patch", "integer"),
                ("preRelease", "string"),
                ("build", "integer"),
                ("securityUpdate", "boolean"),
                ("file", "string"),
                ("releaseNotes", "string"),
            ],
        );
        let numbers = ["major", "minor", "patch"].map(|name| version[name].to_string());
        let expected = [
            env!("CARGO_PKG_VERSION_MAJOR"),
            env!("CARGO_PKG_VERSION_MINOR"),
            env!("CARGO_PKG_VERSION_PATCH"),
        ];
        assert_eq!(numbers, expected);
    }
}

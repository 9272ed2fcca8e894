//! The checked-in API description: completeness and agreement with the code.
#![expect(clippy::unwrap_used, reason = "a failed call fails the test")]

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
};

use lookdown::{
    annotated_picture::{Layer, PictureOptions},
    annotation_formats::AnnotationFormat,
    api::openapi_document,
    pipeline::DetectParameters,
};
use serde_json::Value;

fn document() -> Value {
    serde_json::to_value(openapi_document()).unwrap()
}

/// Every operation with its path.
fn operations(document: &Value) -> Vec<(String, Value)> {
    let paths = document["paths"].as_object().unwrap();
    let operations = paths.iter().flat_map(|(path, item)| {
        let operations = item.as_object().unwrap().values();
        operations.map(|operation| (path.clone(), operation.clone()))
    });
    operations.collect()
}

#[test]
fn the_checked_in_document_matches_the_code() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/openapi/openapi.json");
    let checked_in: Value = serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap();
    assert!(
        checked_in == document(),
        "run `make bless` and review the difference"
    );
}

#[test]
fn every_operation_has_name_summary_tag_and_own_responses() {
    let document = document();
    let mut names = BTreeSet::new();
    for (path, operation) in operations(&document) {
        let name = operation["operationId"].as_str().unwrap();
        assert!(
            name.contains('_'),
            "{path}: {name} is not <verb>_<resource>"
        );
        assert!(names.insert(name.to_owned()), "{name} is not unique");
        assert!(operation["summary"].is_string(), "{path} has no summary");
        assert!(operation["tags"][0].is_string(), "{path} has no tag");
        let statuses = operation["responses"].as_object().unwrap();
        assert!(
            statuses.keys().any(|status| status.starts_with('2')),
            "{path} never succeeds"
        );
    }
    assert_eq!(document["info"]["license"]["identifier"], "Apache-2.0");
    assert!(document["servers"][0]["url"].is_string());
}

#[test]
fn every_failure_is_described_as_a_problem() {
    for (path, operation) in operations(&document()) {
        let responses = operation["responses"].as_object().unwrap();
        for (status, response) in responses
            .iter()
            .filter(|(status, _)| *status >= &"400".to_owned())
        {
            let schema = &response["content"]["application/problem+json"]["schema"]["$ref"];
            assert_eq!(schema, "#/components/schemas/Problem", "{path} {status}");
            let retries = ["429", "503"].contains(&status.as_str());
            let header = response["headers"]["Retry-After"].is_object();
            assert_eq!(header, retries, "{path} {status}");
        }
    }
}

#[test]
fn detection_describes_every_status_and_every_parameter() {
    let document = document();
    let detect = &document["paths"]["/detect"]["post"];
    let statuses: Vec<_> = detect["responses"].as_object().unwrap().keys().collect();
    let expected = [
        "200", "400", "401", "403", "404", "406", "408", "413", "415", "422", "429", "500", "503",
        "504",
    ];
    assert_eq!(statuses, expected);

    let query = detect["parameters"].as_array().unwrap();
    let query: Vec<_> = query
        .iter()
        .map(|parameter| parameter["name"].as_str().unwrap())
        .collect();
    let names: Vec<_> = DetectParameters::NAMES
        .into_iter()
        .chain(["format"])
        .chain(PictureOptions::NAMES)
        .collect();
    assert_eq!(query, names);

    let form = serde_json::to_string(&document["components"]["schemas"]).unwrap();
    for name in names {
        assert!(
            form.contains(&format!("\"{name}\"")),
            "the form lacks {name}"
        );
    }
    let bodies = detect["requestBody"]["content"].as_object().unwrap();
    for media_type in ["multipart/form-data", "application/octet-stream"] {
        assert!(bodies.contains_key(media_type), "{media_type} is missing");
    }
    let answers = detect["responses"]["200"]["content"].as_object().unwrap();
    for media_type in ["application/json", "image/jpeg", "image/png"] {
        assert!(
            answers.contains_key(media_type),
            "{media_type} is not among the responses"
        );
    }
    let report = &answers["application/json"]["schema"]["$ref"];
    assert_eq!(report, "#/components/schemas/Report");
}

#[test]
fn bodies_have_a_schema_and_no_parameter_is_sent_twice() {
    let document = document();
    for (path, operation) in operations(&document) {
        let bodies = operation["requestBody"]["content"].as_object();
        for (media_type, body) in bodies.into_iter().flatten() {
            assert!(body["schema"].is_object(), "{path} {media_type}");
        }
    }
    // Generated clients send defaults by themselves, in the query and in the form.
    let query = &document["paths"]["/detect"]["post"]["parameters"];
    let form = &document["components"]["schemas"]["DetectForm"];
    for described in [query, form] {
        assert!(
            !described.to_string().contains("\"default\":"),
            "{described}"
        );
    }
}

#[test]
fn the_described_formats_and_layers_match_the_parser() {
    let document = document();
    let parameters = document["paths"]["/detect"]["post"]["parameters"].clone();
    let of = |name: &str| {
        let parameters = parameters.as_array().unwrap().iter();
        let mut named = parameters.filter(|parameter| parameter["name"] == name);
        named.next().unwrap()["schema"].clone()
    };
    let forms = of("format").to_string();
    for format in AnnotationFormat::ALL {
        assert!(
            forms.contains(&format!("\"{format}\"")),
            "{format}: {forms}"
        );
    }
    let layers = Layer::ALL.map(Layer::name).join("|");
    let pattern = format!("^(none|({layers})(,({layers}))*)$");
    assert_eq!(of("draw")["pattern"], pattern);
}

#[test]
fn every_operation_lists_its_error_statuses() {
    let listed: BTreeMap<_, _> = operations(&document())
        .into_iter()
        .map(|(_, operation)| {
            let statuses = operation["responses"].as_object().unwrap().keys();
            let failures = statuses.filter(|status| *status >= &"400".to_owned());
            let failures: Vec<_> = failures.cloned().collect();
            let name = operation["operationId"].as_str().unwrap().to_owned();
            (name, failures.join(" "))
        })
        .collect();
    let loading = "400 401 403 404 408 409 413 422 429 500 503 504";
    let inferring = "400 401 403 404 408 413 415 422 429 500 503 504";
    let of_models = "400 401 403 404 429";
    let expected = [
        (
            "detect_persons",
            "400 401 403 404 406 408 413 415 422 429 500 503 504",
        ),
        ("detect_as_deepstack", "400 401 403 408 413 429 500 503"),
        (
            "detect_as_deepstack_with",
            "400 401 403 404 408 413 429 500 503",
        ),
        ("list_as_deepstack", "401 403 429"),
        ("infer_with_model", inferring),
        ("infer_with_model_version", inferring),
        ("get_model", of_models),
        ("get_model_version", of_models),
        ("get_model_readiness", "400 401 403 404 429 503"),
        ("get_model_version_readiness", "400 401 403 404 429 503"),
        ("list_results", "401 403 429 503"),
        ("get_latest_result", "400 401 403 404 422 429 503"),
        ("list_past_results", "400 401 403 404 422 429 503"),
        ("get_latest_picture", "400 401 403 404 422 429 500 503 504"),
        ("try_views", "400 401 403 408 413 422 429 500 503 504"),
        ("listen_to_camera", "401 403 404 429 503"),
        ("listen_to_all", "401 403 429 503"),
        ("list_calibrations", "401 403 429"),
        ("get_calibration", "400 401 403 404 429"),
        (
            "put_calibration",
            "400 401 403 408 409 412 413 422 429 500 503 504",
        ),
        (
            "delete_calibration",
            "400 401 403 404 409 412 429 500 503 504",
        ),
        ("get_views", "400 401 403 404 422 429 500 503 504"),
        ("list_models", "400 401 403 408 413 429 500 504"),
        ("load_model", loading),
        ("unload_model", loading),
        ("get_server_metadata", ""),
        ("get_server_liveness", ""),
        ("get_server_readiness", "503"),
        ("get_liveness", ""),
        ("get_readiness", "503"),
        ("get_metrics", "500"),
        ("get_openapi", ""),
    ];
    let expected = expected.map(|(name, failures)| (name.to_owned(), failures.to_owned()));
    assert_eq!(listed, BTreeMap::from(expected));
}

#[test]
fn the_example_report_has_the_fields_of_the_schema() {
    let document = document();
    let report = &document["components"]["schemas"]["Report"];
    let fields: BTreeSet<_> = report["properties"].as_object().unwrap().keys().collect();
    let example: BTreeSet<_> = report["example"].as_object().unwrap().keys().collect();
    assert_eq!(fields, example);
}

#[test]
fn protected_operations_declare_security_and_its_errors() {
    let document = document();
    let schemes = &document["components"]["securitySchemes"];
    assert_eq!(schemes["bearer"]["scheme"], "bearer");
    assert_eq!(schemes["api_key"]["name"], "X-API-Key");
    for (path, operation) in operations(&document) {
        let responses = &operation["responses"];
        let open = operation["tags"][0] == "operation";
        assert_eq!(operation["security"].is_null(), open, "{path}");
        for status in ["401", "403"] {
            assert_eq!(responses[status].is_null(), open, "{path} {status}");
        }
        let header = &responses["401"]["headers"]["WWW-Authenticate"];
        assert_eq!(header.is_null(), open, "{path}");
    }
}

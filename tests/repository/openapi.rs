//! The checked-in OpenAPI documents and their properties.

use std::{collections::BTreeSet, fs};

use lookdown::{annotated_image::AnnotationOptions, api::openapi_document};
use lookdown_detect::parameters::DetectParameters;
use serde_json::Value;

fn document() -> Value {
    serde_json::to_value(openapi_document(None).unwrap()).unwrap()
}

/// The documents of the server and of the counts, with their files.
fn documents() -> [(&'static str, Value); 2] {
    let counts = serde_json::to_value(lookdown_count::openapi_document()).unwrap();
    [("openapi.json", document()), ("counts.json", counts)]
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
fn the_checked_in_documents_match_the_code() {
    for (file, document) in documents() {
        let path = format!("{}/openapi/{file}", env!("CARGO_MANIFEST_DIR"));
        let checked_in: Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
        assert!(
            checked_in == document,
            "{file}: run `make bless` and review the difference"
        );
    }
}

#[test]
fn every_operation_has_name_summary_tag_and_responses() {
    for (_, document) in documents() {
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
}

#[test]
fn every_operation_refers_to_the_one_problem_response() {
    for (_, document) in documents() {
        for (path, operation) in operations(&document) {
            let responses = operation["responses"].as_object().unwrap();
            let failures = responses
                .iter()
                .filter(|(status, _)| status.as_str() >= "4");
            let failures: Vec<_> = failures
                .map(|(status, response)| (&**status, &response["$ref"]))
                .collect();
            let problem = &Value::from("#/components/responses/Problem");
            assert_eq!(failures, [("4XX", problem), ("5XX", problem)], "{path}");
        }
        let response = &document["components"]["responses"]["Problem"];
        let schema = &response["content"]["application/problem+json"]["schema"]["$ref"];
        assert_eq!(schema, "#/components/schemas/Problem");
        for header in ["Retry-After", "WWW-Authenticate"] {
            assert!(response["headers"][header].is_object(), "{header}");
        }
    }
}

#[test]
fn detection_describes_every_status_and_every_parameter() {
    let document = document();
    let detect = &document["paths"]["/detect"]["post"];
    let statuses: Vec<_> = detect["responses"].as_object().unwrap().keys().collect();
    assert_eq!(statuses, ["200", "4XX", "5XX"]);

    let query = detect["parameters"].as_array().unwrap();
    let query: Vec<_> = query
        .iter()
        .map(|parameter| parameter["name"].as_str().unwrap())
        .collect();
    let [detection, annotation] = [DetectParameters::TABLE, AnnotationOptions::TABLE]
        .map(|table| table.iter().map(|spec| spec.name));
    let names: Vec<_> = detection
        .chain(["format", "oriented"])
        .chain(annotation)
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
        assert!(answers.contains_key(media_type), "{media_type} is missing");
    }
    let report = &answers["application/json"]["schema"]["$ref"];
    assert_eq!(report, "#/components/schemas/Report");
}

#[test]
fn each_body_has_a_schema_and_no_parameter_has_a_default() {
    let document = document();
    for (path, operation) in operations(&document) {
        let bodies = operation["requestBody"]["content"].as_object();
        let responses = operation["responses"].as_object().unwrap().values();
        let responses = responses.filter_map(|response| response["content"].as_object());
        for (media_type, body) in bodies.into_iter().chain(responses).flatten() {
            assert!(body["schema"].is_object(), "{path} {media_type}");
        }
    }
    // Generated clients send a parameter with a default on their own, in the query and in the form.
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
fn choices_list_their_names() {
    let document = document();
    let parameters = &document["paths"]["/detect"]["post"]["parameters"];
    let schema = |name: &str| {
        let mut parameters = parameters.as_array().unwrap().iter();
        let named = parameters.find(|parameter| parameter["name"] == name);
        let schema = &named.unwrap()["schema"];
        let component = schema["$ref"].as_str();
        component
            .map_or(schema, |path| {
                document.pointer(path.trim_start_matches('#')).unwrap()
            })
            .clone()
    };
    let formats = [
        "json",
        "image",
        "coco",
        "cvat",
        "yolo",
        "voc",
        "geojson",
        "cepdof",
        "labelstudio",
    ];
    assert_eq!(schema("format")["enum"], serde_json::json!(formats));
    let layers = "blur|silhouette|boxes|oriented|scores|zones|views|timestamp";
    let pattern = format!("^(none|({layers})(,({layers}))*)$");
    assert_eq!(schema("draw")["pattern"], pattern);
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
fn operations_that_need_a_key_declare_it() {
    let document = document();
    let schemes = &document["components"]["securitySchemes"];
    assert_eq!(schemes["bearer"]["scheme"], "bearer");
    assert_eq!(schemes["api_key"]["name"], "X-API-Key");
    for (path, operation) in operations(&document) {
        let needs_none = operation["security"] == serde_json::json!([{}]);
        assert_eq!(needs_none, operation["tags"][0] == "operation", "{path}");
    }
}

#[test]
fn counts_need_the_scope_read_and_decisions_admin() {
    let [_, (_, document)] = documents();
    let key = |scope| serde_json::json!([{}, {"bearer": [scope]}, {"api_key": [scope]}]);
    for (path, operation) in operations(&document) {
        let expected = match operation["operationId"].as_str() {
            _ if path == "/livez" => serde_json::json!([{}]),
            Some(
                "confirm_furniture"
                | "take_back_furniture"
                | "delete_camera_counts"
                | "acknowledge_floor_alert"
                | "put_reference_crossings"
                | "delete_reference_crossings",
            ) => key("admin"),
            _ => key("read"),
        };
        assert_eq!(operation["security"], expected, "{path}");
    }
}

#[test]
fn form_is_the_first_media_type_of_a_body() {
    let text = serde_json::to_string(&openapi_document(None).unwrap()).unwrap();
    let forms = text.matches("\"multipart/form-data\":").count();
    let first = text
        .matches("\"content\":{\"multipart/form-data\":")
        .count();
    assert!(forms > 0 && forms == first, "{first} of {forms} are first");
}

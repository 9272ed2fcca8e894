//! The model `lookdown`: frames in, persons out.

use serde_json::{Value, json};

use super::{FRAMES, HEAD_LENGTH, assert_refused, fast, floats, in_bytes, in_json, output, send};
use crate::service::{Service, frame};

#[tokio::test]
async fn a_frame_in_json_gives_the_result_of_detect() {
    let service = Service::start();
    let report = service
        .post_raw("calibration=lobby&profile=fast", frame())
        .await
        .json();
    let mut request = in_json(&fast());
    request["id"] = json!("17");
    let answer = service.post(FRAMES, &request.to_string()).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert_eq!(answer.header("content-type"), "application/json");
    assert!(answer.headers.get(HEAD_LENGTH).is_none());
    let json = answer.json();
    assert_eq!(
        (&json["model_name"], &json["model_version"]),
        (&json!("lookdown"), &json!("1"))
    );
    assert_eq!(json["id"], "17");

    let persons = report["persons"].as_array().unwrap();
    assert!(!persons.is_empty());
    let (boxes, _) = output(&answer, "boxes");
    assert_eq!(
        (&boxes["datatype"], &boxes["shape"]),
        (&json!("FP32"), &json!([persons.len(), 4]))
    );
    let column = |name: &str| output(&answer, name).0["data"].as_array().unwrap().clone();
    let close = |found: &Value, wanted: &Value| {
        (found.as_f64().unwrap() - wanted.as_f64().unwrap()).abs() < 1e-4
    };
    for (index, person) in persons.iter().enumerate() {
        for (side, name) in ["x_min", "y_min", "x_max", "y_max"].into_iter().enumerate() {
            assert!(
                close(&boxes["data"][4 * index + side], &person["box"][name]),
                "{person}"
            );
        }
        let turned = ["cx", "cy", "width", "height", "angle_deg"];
        for (side, name) in turned.into_iter().enumerate() {
            let found = &column("oriented_boxes")[5 * index + side];
            assert!(close(found, &person["oriented_box"][name]), "{person}");
        }
        assert!(close(&column("scores")[index], &person["score"]));
        assert_eq!(column("views")[index], person["views"]);
    }
    let reported: Value = serde_json::from_str(column("report")[0].as_str().unwrap()).unwrap();
    assert_eq!(reported["persons"], report["persons"]);
    assert_eq!(answer.header("x-person-count"), persons.len().to_string());
    assert!(answer.header("server-timing").contains("inference;dur="));
    let latest = service.get("/results/lobby/latest").await.json();
    assert_eq!(
        latest["request_id"],
        answer.header("x-request-id"),
        "it is published"
    );
}

#[tokio::test]
async fn a_frame_after_json_gives_the_same_result_also_as_bytes() {
    let service = Service::start();
    let wanted = service.post(FRAMES, &in_json(&fast()).to_string()).await;
    let (boxes, _) = output(&wanted, "boxes");
    let boxes = boxes["data"].as_array().unwrap().iter();
    #[expect(
        clippy::cast_possible_truncation,
        reason = "FP32 outputs have this precision"
    )]
    let boxes: Vec<_> = boxes.map(|side| side.as_f64().unwrap() as f32).collect();

    let mut parameters = fast();
    parameters["binary_data_output"] = json!(true);
    let (head, behind) = in_bytes(&frame(), &parameters);
    let all = send(&service, FRAMES, &head, &behind).await;
    assert_eq!(all.status, 200);
    assert_eq!(all.header("content-type"), "application/octet-stream");
    let (described, bytes) = output(&all, "boxes");
    assert!(described["data"].is_null());
    assert_eq!(floats(&bytes), boxes);
    let (_, report) = output(&all, "report");
    assert_eq!(
        report[..4],
        u32::try_from(report.len() - 4).unwrap().to_le_bytes()
    );
    serde_json::from_slice::<Value>(&report[4..]).unwrap();

    let (mut head, behind) = in_bytes(&frame(), &fast());
    let binary = json!({ "binary_data": true });
    head["outputs"] = json!([{ "name": "scores" }, { "name": "boxes", "parameters": binary }]);
    let some = send(&service, FRAMES, &head, &behind).await;
    let length: usize = some.header(HEAD_LENGTH).parse().unwrap();
    let reported: Value = serde_json::from_slice(&some.body[..length]).unwrap();
    assert_eq!(reported["outputs"].as_array().unwrap().len(), 2);
    assert!(output(&some, "scores").0["data"].is_array());
    assert_eq!(floats(&output(&some, "boxes").1), boxes);
}

#[tokio::test]
async fn parameters_of_detect_are_parameters_of_the_request() {
    let service = Service::start();
    for (parameters, status, kind, part) in [
        (
            json!({ "score_threshold": 1.5 }),
            422,
            "invalid-parameter",
            "score_threshold: \"1.5\" is not a number from 0 to 1",
        ),
        (
            json!({ "score_threshold": "0.5" }),
            422,
            "invalid-parameter",
            "a number",
        ),
        (
            json!({ "calibration": 7 }),
            422,
            "invalid-parameter",
            "a text",
        ),
        (
            json!({ "motion": 1 }),
            422,
            "invalid-parameter",
            "true or false",
        ),
        (
            json!({ "timeout": 1.5 }),
            422,
            "invalid-parameter",
            "microseconds",
        ),
        (
            json!({ "priority": 0 }),
            422,
            "invalid-parameter",
            "priority: ",
        ),
        (
            json!({ "binary_data_output": 1 }),
            422,
            "invalid-parameter",
            "binary_data_output",
        ),
        (
            json!({ "sequence_id": 3 }),
            400,
            "unknown-parameter",
            "sequence_id",
        ),
        (json!({ "draw": "boxes" }), 400, "unknown-parameter", "draw"),
        (
            json!({ "timeout": 9_000_000, "timeout_millis": 9000 }),
            400,
            "repeated-parameter",
            "twice",
        ),
        (
            json!({ "calibration": "missing" }),
            404,
            "unknown-calibration",
            "missing",
        ),
        (
            json!({ "model": "missing" }),
            404,
            "unknown-model",
            "missing",
        ),
        (
            json!({ "calibration": [] }),
            400,
            "malformed-request",
            "a parameter: a text",
        ),
    ] {
        let answer = service
            .post(FRAMES, &in_json(&parameters).to_string())
            .await;
        assert_refused(&answer, status, kind, part);
    }
    let mut parameters = fast();
    parameters["score_threshold"] = json!(1);
    parameters["priority"] = json!(1);
    parameters["timeout"] = json!(10_000_000);
    parameters["refine"] = json!(null);
    let answer = service
        .post(FRAMES, &in_json(&parameters).to_string())
        .await;
    assert_eq!(output(&answer, "boxes").0["shape"], json!([0, 4]));
}

#[tokio::test]
async fn a_request_has_its_own_deadline_in_microseconds() {
    let service = Service::start();
    service.gate.close();
    let mut parameters = fast();
    parameters["timeout"] = json!(40_000);
    let answer = service
        .post(FRAMES, &in_json(&parameters).to_string())
        .await;
    assert_refused(&answer, 504, "timeout", "within 0.04 s");
    service.gate.open();
    service.still_works().await;
}

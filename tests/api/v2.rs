//! The Open Inference Protocol: JSON and bytes, frames and views.

use axum::{
    body::Body,
    http::{Request, StatusCode},
};
use lookdown::api::Access;
use serde_json::{Value, json};

use crate::service::{Answer, Bounds, Service, frame};

const FRAMES: &str = "/v2/models/lookdown/infer";
const VIEWS: &str = "/v2/models/eager/infer";
const FAST: [(&str, &str); 2] = [("calibration", "lobby"), ("profile", "fast")];
const HEAD_LENGTH: &str = "inference-header-content-length";

/// Base64 (RFC 4648, section 4), written here once more so that the server's is not asked.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let byte = |index: usize| usize::from(chunk.get(index).copied().unwrap_or(0));
        let bits = byte(0) * 65_536 + byte(1) * 256 + byte(2);
        for (index, unit) in [262_144, 4096, 64, 1].into_iter().enumerate() {
            let letter = char::from(LETTERS[bits / unit % 64]);
            text.push(if index <= chunk.len() { letter } else { '=' });
        }
    }
    text
}

fn fast() -> Value {
    FAST.into_iter()
        .map(|(name, value)| (name.to_owned(), json!(value)))
        .collect()
}

/// A request for the persons in a frame, the frame in its JSON.
fn in_json(parameters: &Value) -> Value {
    let input =
        json!({ "name": "image", "datatype": "BYTES", "shape": [1], "data": [base64(&frame())] });
    json!({ "inputs": [input], "parameters": parameters })
}

/// An element of `BYTES`.
fn element(content: &[u8]) -> Vec<u8> {
    let length = u32::try_from(content.len()).unwrap();
    [&length.to_le_bytes(), content].concat()
}

/// Sends JSON with bytes behind it.
async fn send(service: &Service, path: &str, head: &Value, behind: &[u8]) -> Answer {
    let head = head.to_string();
    let request = Request::post(path).header(HEAD_LENGTH, head.len());
    let body = [head.as_bytes(), behind].concat();
    service.send(request.body(Body::from(body)).unwrap()).await
}

/// A request for the persons in a frame, the frame behind its JSON.
fn in_bytes(frame: &[u8], parameters: &Value) -> (Value, Vec<u8>) {
    let behind = element(frame);
    let input = json!({
        "name": "image", "datatype": "BYTES", "shape": [1],
        "parameters": { "binary_data_size": behind.len() }
    });
    (
        json!({ "inputs": [input], "parameters": parameters }),
        behind,
    )
}

/// The output of that name in an answer, and its bytes if it came as bytes.
fn output(answer: &Answer, name: &str) -> (Value, Vec<u8>) {
    let length = answer.headers.get(HEAD_LENGTH);
    let length = length.map_or(answer.body.len(), |length| {
        length.to_str().unwrap().parse().unwrap()
    });
    let head: Value = serde_json::from_slice(&answer.body[..length]).unwrap();
    let mut at = length;
    for output in head["outputs"].as_array().unwrap() {
        let size = output["parameters"]["binary_data_size"]
            .as_u64()
            .unwrap_or(0);
        let size = usize::try_from(size).unwrap();
        if output["name"] == name {
            return (output.clone(), answer.body[at..at + size].to_vec());
        }
        at += size;
    }
    panic!("there is no output {name} in {head}");
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    let words = bytes.chunks_exact(4);
    words
        .map(|word| f32::from_le_bytes(word.try_into().unwrap()))
        .collect()
}

#[track_caller]
fn assert_refused(answer: &Answer, status: u16, kind: &str, part: &str) {
    assert_eq!(answer.status, status, "{part}: {}", answer.text());
    let problem = answer.problem();
    assert_eq!(
        problem["type"],
        format!("urn:lookdown:problem:{kind}"),
        "{part}: {problem}"
    );
    let told = problem["error"].as_str().unwrap();
    assert!(told.contains(part), "{part}: {told}");
}

#[tokio::test]
async fn the_server_and_its_models_describe_themselves() {
    let service = Service::start();
    let server = service.get("/v2").await.json();
    assert_eq!(server["name"], "lookdown");
    assert_eq!(
        server["extensions"],
        json!(["binary_tensor_data", "model_repository"])
    );
    assert_eq!(
        service.get("/v2/health/live").await.json(),
        json!({ "live": true })
    );
    assert_eq!(
        service.get("/v2/health/ready").await.json(),
        json!({ "ready": true })
    );

    let frames = service.get("/v2/models/lookdown").await.json();
    let image = json!([{ "name": "image", "datatype": "BYTES", "shape": [1] }]);
    assert_eq!(
        (&frames["inputs"], &frames["versions"]),
        (&image, &json!(["1"]))
    );
    let outputs = frames["outputs"].as_array().unwrap().iter();
    let outputs: Vec<_> = outputs
        .map(|output| output["name"].as_str().unwrap())
        .collect();
    assert_eq!(
        outputs,
        ["boxes", "scores", "oriented_boxes", "views", "report"]
    );

    let detector = service.get("/v2/models/eager/versions/1").await.json();
    let views = json!([{ "name": "views", "datatype": "FP32", "shape": [-1, 3, 64, 64] }]);
    assert_eq!(
        (&detector["name"], &detector["inputs"]),
        (&json!("eager"), &views)
    );
    for model in [
        "lookdown",
        "eager",
        "lookdown/versions/1",
        "eager/versions/1",
    ] {
        let ready = service.get(&format!("/v2/models/{model}/ready")).await;
        assert_eq!(
            (ready.status, &ready.json()["ready"]),
            (StatusCode::OK, &json!(true))
        );
    }
    for path in [
        "nobody",
        "nobody/ready",
        "eager/versions/2",
        "lookdown/versions/2/ready",
    ] {
        let answer = service.get(&format!("/v2/models/{path}")).await;
        assert_refused(&answer, 404, "unknown-model", "model: ");
    }
}

#[tokio::test]
async fn a_server_that_is_about_to_stop_is_not_ready_and_its_models_neither() {
    let service = Service::start();
    service.readiness.stopping();
    for path in [
        "/v2/health/ready",
        "/v2/models/lookdown/ready",
        "/v2/models/eager/versions/1/ready",
    ] {
        let answer = service.get(path).await;
        assert_refused(&answer, 503, "shutting-down", "shutting down");
        assert_eq!(answer.header("retry-after"), "1");
    }
    assert_eq!(service.get("/v2/health/live").await.status, 200);
}

#[tokio::test]
async fn a_frame_in_json_is_answered_as_detect_answers_it() {
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
    let told: Value = serde_json::from_str(column("report")[0].as_str().unwrap()).unwrap();
    assert_eq!(told["persons"], report["persons"]);
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
async fn a_frame_behind_json_is_answered_the_same_and_outputs_come_as_bytes_where_asked() {
    let service = Service::start();
    let wanted = service.post(FRAMES, &in_json(&fast()).to_string()).await;
    let (boxes, _) = output(&wanted, "boxes");
    let boxes = boxes["data"].as_array().unwrap().iter();
    #[expect(clippy::cast_possible_truncation, reason = "they are FP32")]
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
    let told: Value = serde_json::from_slice(&some.body[..length]).unwrap();
    assert_eq!(told["outputs"].as_array().unwrap().len(), 2);
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
            "score_threshold: 1.5",
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
            json!({ "calibration": "nobody" }),
            404,
            "unknown-calibration",
            "nobody",
        ),
        (json!({ "model": "nobody" }), 404, "unknown-model", "nobody"),
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
    let views = json!({ "name": "views", "datatype": "UINT8", "shape": [1, 3, 64, 64],
        "parameters": { "binary_data_size": 12288 } });
    let head = json!({ "inputs": [views], "parameters": { "timeout": 40_000 } });
    let answer = send(&service, VIEWS, &head, &[0; 12288]).await;
    assert_refused(&answer, 504, "timeout", "timeout_millis");
    service.gate.open();
    service.still_works().await;
}

#[tokio::test]
async fn tensors_that_do_not_fit_are_told_in_one_sentence() {
    let service = Service::start();
    let image = base64(&frame());
    let input = |shape: Value, data: Value| json!({ "name": "image", "datatype": "BYTES", "shape": shape, "data": data });
    for (inputs, part) in [
        (json!([]), "image is missing"),
        (
            json!([
                input(json!([1]), json!([image])),
                input(json!([1]), json!([image]))
            ]),
            "once",
        ),
        (
            json!([{ "name": "img", "datatype": "BYTES", "shape": [1], "data": [image] }]),
            "no such input",
        ),
        (
            json!([input(json!([2]), json!([image, image]))]),
            "one frame is taken at a time",
        ),
        (
            json!([input(json!([0]), json!([]))]),
            "one frame is taken at a time",
        ),
        (json!([input(json!([1]), json!([]))]), "empty"),
        (
            json!([input(json!([1]), json!([image, image]))]),
            "more than one",
        ),
        (json!([input(json!([1]), json!(["*"]))]), "no base64"),
        (json!([input(json!([1]), json!([""]))]), "it is empty"),
        (json!([input(json!([1]), json!(image))]), "no list"),
        (
            json!([input(json!([65536, 65536, 65536, 65536, 2]), json!([]))]),
            "more elements than memory",
        ),
        (
            json!([{ "name": "image", "datatype": "FP16", "shape": [1], "data": [1] }]),
            "FP16",
        ),
        (
            json!([{ "name": "image", "datatype": "FP32", "shape": [1], "data": [1] }]),
            "its datatype is BYTES",
        ),
        (
            json!([{ "name": "image", "datatype": "FP32", "shape": [2], "data": [1] }]),
            "asks for 2",
        ),
        (
            json!([{ "name": "image", "datatype": "BYTES", "shape": [1] }]),
            "neither data",
        ),
        (
            json!([{ "name": "image", "datatype": "BYTES", "shape": [1], "data": [image],
                "parameters": { "binary_data_size": 4 } }]),
            "as well as",
        ),
        (
            json!([{ "name": "image", "datatype": "BYTES", "shape": [1],
                "parameters": { "binary_data_size": 4 } }]),
            "0 bytes are left",
        ),
        (
            json!([{ "name": "image", "datatype": "BYTES", "shape": [1],
                "parameters": { "binary_data_size": -1 } }]),
            "a number of bytes",
        ),
        (
            json!([{ "name": "image", "datatype": "BYTES", "shape": [1],
                "parameters": { "shared_memory_region": "pictures", "shared_memory_byte_size": 9 } }]),
            "shared memory is not offered",
        ),
        (
            json!([{ "name": "image", "datatype": "BYTES", "shape": [1], "data": [image],
                "parameters": { "content_type": "base64" } }]),
            "content_type",
        ),
    ] {
        let answer = service
            .post(FRAMES, &json!({ "inputs": inputs }).to_string())
            .await;
        assert_refused(&answer, 422, "invalid-tensor", part);
    }
    assert_eq!(service.gate.runs(), 0, "nothing of that was looked at");
    service.still_works().await;
}

#[tokio::test]
async fn outputs_that_there_are_not_are_told_in_one_sentence() {
    let service = Service::start();
    for (outputs, part) in [
        (
            json!([{ "name": "masks" }]),
            "no such output: there are boxes",
        ),
        (json!([{ "name": "boxes" }, { "name": "boxes" }]), "twice"),
        (
            json!([{ "name": "boxes", "parameters": { "classification": 3 } }]),
            "classification",
        ),
        (
            json!([{ "name": "boxes", "parameters": { "binary_data": "yes" } }]),
            "binary_data",
        ),
        (
            json!([{ "name": "boxes", "parameters": { "binary_data": false, "shared_memory_region": "r" } }]),
            "shared memory is not offered",
        ),
    ] {
        let mut request = in_json(&fast());
        request["outputs"] = outputs;
        let answer = service.post(FRAMES, &request.to_string()).await;
        assert_refused(&answer, 422, "invalid-tensor", part);
    }
    assert_eq!(service.gate.runs(), 0, "nothing of that was looked at");
    service.still_works().await;
}

#[tokio::test]
async fn requests_that_are_none_are_malformed() {
    let service = Service::start();
    let many = json!({ "inputs": vec![json!({}); 1000] }).to_string();
    for (body, part) in [
        ("", "EOF"),
        ("{", "EOF"),
        ("[]", "an object"),
        ("{}", "inputs"),
        (r#"{"inputs": {}}"#, "a list"),
        (
            r#"{"inputs": [["image", [1], "BYTES", null, ["AA=="]]]}"#,
            "an object",
        ),
        (
            r#"{"inputs": [{"name": "image", "shape": [-1], "datatype": "BYTES", "data": []}]}"#,
            "-1",
        ),
        (r#"{"inputs": [], "more": 1}"#, "more"),
        (r#"{"inputs": [], "inputs": []}"#, "duplicate"),
        (r#"{"inputs": [], "parameters": []}"#, "parameters"),
        (&many, "name"),
    ] {
        let answer = service.post(FRAMES, body).await;
        assert_refused(&answer, 400, "malformed-request", part);
    }
    let shape = vec![1; 17];
    let long =
        json!({ "inputs": [{ "name": "image", "shape": shape, "datatype": "BYTES", "data": [] }] });
    let answer = service.post(FRAMES, &long.to_string()).await;
    assert_refused(&answer, 400, "malformed-request", "more than 16");
    let mut request = in_json(&fast());
    request["id"] = json!("x".repeat(257));
    let answer = service.post(FRAMES, &request.to_string()).await;
    assert_refused(&answer, 422, "invalid-parameter", "id: ");

    let whole = in_json(&fast()).to_string();
    for (name, value, part) in [
        (HEAD_LENGTH, "1000000", "1000000"),
        (HEAD_LENGTH, "-1", "-1"),
        (HEAD_LENGTH, "many", "many"),
        (HEAD_LENGTH, "0", "EOF"),
        ("content-encoding", "gzip", "compressed"),
    ] {
        let request = Request::post(FRAMES).header(name, value);
        let answer = service
            .send(request.body(Body::from(whole.clone())).unwrap())
            .await;
        assert_refused(&answer, 400, "malformed-request", part);
    }
}

#[tokio::test]
async fn bytes_that_do_not_add_up_are_told() {
    let service = Service::start();
    let (head, behind) = in_bytes(&frame(), &fast());
    let answer = send(&service, FRAMES, &head, &[&behind[..], b"more"].concat()).await;
    assert_refused(&answer, 400, "malformed-request", "4 bytes follow");
    let answer = send(&service, FRAMES, &head, &behind[..100]).await;
    assert_refused(&answer, 422, "invalid-tensor", "100 bytes are left");
    let mut wrong = behind.clone();
    wrong[0] ^= 1;
    let answer = send(&service, FRAMES, &head, &wrong).await;
    assert_refused(&answer, 422, "invalid-tensor", "its length is");
    let mut none = head.clone();
    none["inputs"][0]["parameters"]["binary_data_size"] = json!(2);
    let answer = send(&service, FRAMES, &none, b"ab").await;
    assert_refused(&answer, 422, "invalid-tensor", "its length in four bytes");
    let (head, behind) = in_bytes(b"no picture", &fast());
    let answer = send(&service, FRAMES, &head, &behind).await;
    assert_refused(&answer, 415, "unsupported-image", "");
}

#[tokio::test]
async fn a_detector_finds_what_is_in_each_view() {
    let service = Service::start();
    let view = |datatype: &str, size: usize| {
        json!({
            "name": "views", "datatype": datatype, "shape": [2, 3, 64, 64],
            "parameters": { "binary_data_size": size }
        })
    };
    let numbers = 2 * 3 * 64 * 64;
    let as_floats: Vec<u8> = [100.0_f32]
        .repeat(numbers)
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    let outputs = json!([{ "name": "boxes" }, { "name": "scores" }]);
    for (input, behind) in [
        (view("UINT8", numbers), vec![100; numbers]),
        (view("FP32", 4 * numbers), as_floats),
    ] {
        let head =
            json!({ "inputs": [input], "outputs": outputs, "parameters": { "priority": 2 } });
        let answer = send(&service, VIEWS, &head, &behind).await;
        assert_eq!(answer.status, 200, "{}", answer.text());
        assert_eq!(answer.json()["model_version"], "1");
        let (boxes, _) = output(&answer, "boxes");
        assert_eq!(boxes["shape"], json!([2, 1, 4]));
        assert_eq!(
            boxes["data"],
            json!([24.0, 16.0, 40.0, 48.0, 24.0, 16.0, 40.0, 48.0])
        );
        let (scores, _) = output(&answer, "scores");
        assert_eq!(
            (&scores["shape"], scores["data"].as_array().unwrap().len()),
            (&json!([2, 1]), 2)
        );
    }
    let nested = vec![vec![vec![vec![7; 64]; 64]; 3]; 1];
    let input =
        json!({ "name": "views", "datatype": "UINT8", "shape": [1, 3, 64, 64], "data": nested });
    let versioned = "/v2/models/eager/versions/1/infer";
    let answer = service
        .post(versioned, &json!({ "inputs": [input] }).to_string())
        .await;
    assert_eq!(output(&answer, "scores").0["shape"], json!([1, 1]));
}

#[tokio::test]
async fn views_that_a_detector_cannot_look_at_are_told() {
    let service = Service::start();
    let views = |shape: Value, data: Value| json!({ "inputs": [{ "name": "views", "datatype": "UINT8", "shape": shape, "data": data }] });
    for (request, part) in [
        (
            views(json!([1, 3, 2, 2]), json!(vec![0; 12])),
            "[views, 3, 64, 64] is needed",
        ),
        (views(json!([0, 3, 64, 64]), json!([])), "at least one view"),
        (views(json!([12]), json!(vec![0; 12])), "[views, 3, 64, 64]"),
        (
            views(json!([1, 3, 64, 64]), json!(vec![0; 12])),
            "asks for 12288",
        ),
        (in_json(&json!({})), "views is the one there is"),
        (
            json!({ "inputs": [{ "name": "views", "datatype": "BYTES", "shape": [1], "data": ["AAAA"] }] }),
            "FP32 or UINT8",
        ),
    ] {
        let answer = service.post(VIEWS, &request.to_string()).await;
        assert_refused(&answer, 422, "invalid-tensor", part);
    }
    let mut request = views(json!([1, 3, 64, 64]), json!(vec![0; 12288]));
    request["parameters"] = json!({ "profile": "fast" });
    let answer = service.post(VIEWS, &request.to_string()).await;
    assert_refused(&answer, 400, "unknown-parameter", "priority, timeout");
    assert_refused(
        &service.post("/v2/models/nobody/infer", "{}").await,
        404,
        "unknown-model",
        "eager",
    );
    assert_refused(
        &service
            .post("/v2/models/eager/versions/9/infer", "{}")
            .await,
        404,
        "unknown-model",
        "version 1",
    );
    for path in [
        "/v2/systemsharedmemory/region/r/register",
        "/v2/models/lookdown/config",
    ] {
        assert_eq!(service.post(path, "{}").await.status, 404);
    }
}

#[tokio::test]
async fn views_have_places_like_frames_and_bodies_have_limits() {
    let service = Service::within(&Bounds {
        frames_in_flight: 1,
        max_body_bytes: 100_000,
        ..Bounds::default()
    });
    let head = json!({ "inputs": [{ "name": "views", "datatype": "UINT8", "shape": [1, 3, 64, 64],
        "parameters": { "binary_data_size": 12288 } }] });
    service.gate.close();
    let (waiting, refused) = tokio::join!(send(&service, VIEWS, &head, &[0; 12288]), async {
        service.gate.has_begun(1).await;
        let refused = send(&service, VIEWS, &head, &[0; 12288]).await;
        service.gate.open();
        refused
    });
    assert_eq!(waiting.status, 200);
    assert_refused(&refused, 429, "overloaded", "places in the queue");
    let answer = service.post(FRAMES, &" ".repeat(100_001)).await;
    assert_refused(&answer, 413, "body-too-large", "100000");
    service.gate.panic_once();
    let answer = send(&service, VIEWS, &head, &[0; 12288]).await;
    assert_refused(&answer, 500, "internal", "fault");
    let answer = send(&service, VIEWS, &head, &[0; 12288]).await;
    assert_eq!(answer.status, 200, "the place is free again");
}

#[tokio::test]
async fn without_keys_everybody_who_reaches_the_server_may_ask_its_models() {
    let service = Service::within(&Bounds {
        access: Access::Open {
            own_machine_only: false,
        },
        ..Bounds::default()
    });
    assert_eq!(service.get("/v2/models/eager").await.status, 200);
    assert_eq!(
        service
            .post(FRAMES, &in_json(&fast()).to_string())
            .await
            .status,
        200
    );
}

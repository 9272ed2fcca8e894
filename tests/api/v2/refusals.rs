//! Invalid inference requests: each is refused in one sentence.

use axum::{body::Body, http::Request};
use serde_json::{Value, json};

use super::{FRAMES, HEAD_LENGTH, assert_refused, base64, fast, in_bytes, in_json, send};
use crate::service::{Service, frame};

#[tokio::test]
async fn unusable_tensors_are_refused_in_one_sentence() {
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
            json!([input(json!([2]), json!([image]))]),
            "1 elements, but its shape needs 2",
        ),
        (
            json!([{ "name": "", "datatype": "BYTES", "shape": [1], "data": [image] }]),
            "inputs: an input has no name",
        ),
        (json!([input(json!([0]), json!([]))]), "[1] to [16]"),
        (
            json!([input(json!([17]), json!(vec!["AA=="; 17]))]),
            "[1] to [16]",
        ),
        (
            json!([input(json!([1]), json!([]))]),
            "0 elements, but its shape needs 1",
        ),
        (
            json!([input(json!([1]), json!([image, image]))]),
            "more elements than the 1",
        ),
        (
            json!([input(json!([2]), json!([image, ""]))]),
            "element 1 is empty",
        ),
        (json!([input(json!([1]), json!(["*"]))]), "not base64"),
        (
            json!([input(json!([1]), json!([""]))]),
            "element 0 is empty",
        ),
        (json!([input(json!([1]), json!(image))]), "not a list"),
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
            "send BYTES",
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
                "parameters": { "shared_memory_region": "images", "shared_memory_byte_size": 9 } }]),
            "shared memory is not supported",
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
    assert_eq!(service.gate.runs(), 0, "no request reached the model");
    service.still_works().await;
}

#[tokio::test]
async fn unknown_outputs_are_refused_in_one_sentence() {
    let service = Service::start();
    for (outputs, part) in [
        (
            json!([{ "name": "masks" }]),
            "no such output: the outputs are boxes",
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
            "shared memory is not supported",
        ),
    ] {
        let mut request = in_json(&fast());
        request["outputs"] = outputs;
        let answer = service.post(FRAMES, &request.to_string()).await;
        assert_refused(&answer, 422, "invalid-tensor", part);
    }
    assert_eq!(service.gate.runs(), 0, "no request reached the model");
    service.still_works().await;
}

#[tokio::test]
async fn invalid_requests_are_malformed() {
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
        ("content-encoding", "gzip", "cannot be decompressed"),
        ("content-encoding", "deflate", "cannot be decompressed"),
        ("content-encoding", "br", "send gzip, deflate"),
    ] {
        let request = Request::post(FRAMES).header(name, value);
        let answer = service
            .send(request.body(Body::from(whole.clone())).unwrap())
            .await;
        assert_refused(&answer, 400, "malformed-request", part);
    }
}

#[tokio::test]
async fn inconsistent_byte_counts_are_refused() {
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
    let (head, behind) = in_bytes(b"no image", &fast());
    let answer = send(&service, FRAMES, &head, &behind).await;
    assert_refused(&answer, 415, "unsupported-image", "");
}

//! The Open Inference Protocol: frames in JSON and as bytes.

mod batch;
mod describe;
mod frames;
mod refusals;

use axum::{body::Body, http::Request};
use serde_json::{Value, json};

use crate::service::{Answer, Service, frame};

const FRAMES: &str = "/v2/models/lookdown/infer";
const FAST: [(&str, &str); 2] = [("calibration", "lobby"), ("profile", "fast")];
const HEAD_LENGTH: &str = "inference-header-content-length";

/// Base64 (RFC 4648, section 4), independent of the server's implementation.
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

/// An inference request for a frame inside its JSON.
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

/// Sends JSON followed by bytes.
async fn send(service: &Service, path: &str, head: &Value, behind: &[u8]) -> Answer {
    let head = head.to_string();
    let request = Request::post(path).header(HEAD_LENGTH, head.len());
    let body = [head.as_bytes(), behind].concat();
    service.send(request.body(Body::from(body)).unwrap()).await
}

/// An inference request for a frame after its JSON.
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

/// Returns the output of that name in a response, and its bytes if it was sent as bytes.
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
        format!("/problems/{kind}"),
        "{part}: {problem}"
    );
    let reported = problem["error"].as_str().unwrap();
    assert!(reported.contains(part), "{part}: {reported}");
}

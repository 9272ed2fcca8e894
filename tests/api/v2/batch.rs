//! The model `lookdown`: several frames in a request, and compressed requests.

use std::{io::Write, num::NonZeroU32};

use axum::{body::Body, http::Request};
use flate2::{
    Compression,
    write::{GzEncoder, ZlibEncoder},
};
use lookdown::api::RequestRate;
use serde_json::{Value, json};

use super::{FRAMES, HEAD_LENGTH, assert_refused, base64, element, fast, in_bytes, output, send};
use crate::service::{Answer, Bounds, Service, frame, frame_of};

/// A request for these frames inside its JSON.
fn batch(frames: &[Vec<u8>], parameters: &Value) -> Value {
    let data: Vec<_> = frames.iter().map(|frame| base64(frame)).collect();
    let input =
        json!({ "name": "image", "datatype": "BYTES", "shape": [frames.len()], "data": data });
    json!({ "inputs": [input], "parameters": parameters })
}

fn column(answer: &Answer, name: &str) -> Vec<Value> {
    output(answer, name).0["data"].as_array().unwrap().clone()
}

#[tokio::test]
async fn a_batch_has_the_persons_of_its_frames_in_order() {
    let service = Service::start();
    let frames = [frame(), frame_of(200, 100), frame()];
    let parameters = json!({ "profile": "fast" });
    let mut persons = Vec::new();
    for frame in &frames {
        let report = service.post_raw("profile=fast", frame.clone()).await.json();
        persons.push(report["persons"].as_array().unwrap().clone());
    }
    assert!(!persons[0].is_empty());
    let total: usize = persons.iter().map(Vec::len).sum();

    let answer = service
        .post(FRAMES, &batch(&frames, &parameters).to_string())
        .await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert_eq!(answer.header("x-person-count"), total.to_string());
    let counts: Vec<_> = persons.iter().map(Vec::len).collect();
    assert_eq!(json!(column(&answer, "counts")), json!(counts));
    assert_eq!(output(&answer, "boxes").0["shape"], json!([total, 4]));
    assert_eq!(output(&answer, "report").0["shape"], json!([3]));
    let all: Vec<_> = persons.concat();
    for (score, person) in column(&answer, "scores").iter().zip(&all) {
        assert!((score.as_f64().unwrap() - person["score"].as_f64().unwrap()).abs() < 1e-4);
    }
    for (report, persons) in column(&answer, "report").iter().zip(persons) {
        let report: Value = serde_json::from_str(report.as_str().unwrap()).unwrap();
        assert_eq!(report["persons"], json!(persons));
    }
}

#[tokio::test]
async fn a_batch_after_json_gives_the_same_result() {
    let service = Service::start();
    let frames = [frame(), frame()];
    let wanted = service
        .post(FRAMES, &batch(&frames, &fast()).to_string())
        .await;
    let behind = frames.map(|frame| element(&frame)).concat();
    let input = json!({
        "name": "image", "datatype": "BYTES", "shape": [2, 1],
        "parameters": { "binary_data_size": behind.len() }
    });
    let head = json!({ "inputs": [input], "parameters": fast() });
    let answer = send(&service, FRAMES, &head, &behind).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    for name in ["boxes", "scores", "oriented_boxes", "views", "counts"] {
        assert_eq!(output(&answer, name).0, output(&wanted, name).0, "{name}");
    }
}

#[tokio::test]
async fn the_first_failure_of_a_batch_is_named_by_its_index() {
    let service = Service::start();
    let one = batch(&[frame()], &fast()).to_string();
    service.post(FRAMES, &one).await;
    let runs_of_a_frame = service.gate.runs();
    let frames = [frame(), b"no image".to_vec(), frame()];
    let answer = service
        .post(FRAMES, &batch(&frames, &fast()).to_string())
        .await;
    assert_refused(&answer, 415, "unsupported-image", "image[1]: ");
    let runs = service.gate.runs() - runs_of_a_frame;
    assert_eq!(runs, runs_of_a_frame, "the third frame is not processed");
    service.still_works().await;
}

#[tokio::test]
async fn each_frame_of_a_batch_takes_a_token_of_the_rate_limit() {
    let service = Service::within(&Bounds {
        request_rate: Some(RequestRate {
            per_second: 0.001,
            burst: NonZeroU32::new(3).unwrap(),
        }),
        ..Bounds::default()
    });
    let frames = [frame(), frame(), frame(), frame()];
    let request = batch(&frames[..2], &fast()).to_string();
    let answer = service.post(FRAMES, &request).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert!(answer.header("ratelimit").contains("r=1;"));
    let answer = service.post(FRAMES, &request).await;
    assert_refused(&answer, 429, "rate-limited", "image[1]: ");
}

#[tokio::test]
async fn a_batch_needs_one_permit_at_a_time() {
    let service = Service::within(&Bounds {
        frames_in_flight: 1,
        ..Bounds::default()
    });
    let frames = vec![frame(); 4];
    let answer = service
        .post(FRAMES, &batch(&frames, &fast()).to_string())
        .await;
    assert_eq!(answer.status, 200, "{}", answer.text());
}

async fn send_encoded(service: &Service, encoding: &str, length: usize, body: Vec<u8>) -> Answer {
    let request = Request::post(FRAMES)
        .header(HEAD_LENGTH, length)
        .header("content-encoding", encoding);
    service.send(request.body(Body::from(body)).unwrap()).await
}

#[tokio::test]
async fn compressed_requests_are_read() {
    let service = Service::start();
    let (head, behind) = in_bytes(&frame(), &fast());
    let head = head.to_string();
    let plain = [head.as_bytes(), &behind].concat();
    let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
    gzip.write_all(&plain).unwrap();
    let mut deflate = ZlibEncoder::new(Vec::new(), Compression::fast());
    deflate.write_all(&plain).unwrap();
    for (encoding, body) in [
        ("gzip", gzip.finish().unwrap()),
        ("deflate", deflate.finish().unwrap()),
        ("identity", plain),
    ] {
        let whole = send_encoded(&service, encoding, head.len(), body.clone()).await;
        assert_eq!(whole.status, 200, "{encoding}: {}", whole.text());
        if encoding != "identity" {
            let cut = body[..body.len() / 2].to_vec();
            let answer = send_encoded(&service, encoding, head.len(), cut).await;
            assert_refused(&answer, 400, "malformed-request", "cannot be decompressed");
        }
    }
}

#[tokio::test]
async fn a_decompressed_body_has_the_limit_of_a_body() {
    let service = Service::within(&Bounds {
        max_body_bytes: 100_000,
        ..Bounds::default()
    });
    let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
    gzip.write_all(&vec![b' '; 1_000_000]).unwrap();
    let body = gzip.finish().unwrap();
    assert!(body.len() < 2000);
    let answer = send_encoded(&service, "gzip", 2, body).await;
    assert_refused(&answer, 413, "body-too-large", "decompressed");
    service.still_works().await;
}

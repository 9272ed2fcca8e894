//! The detectors: views in, detections out.

use serde_json::{Value, json};

use super::{FRAMES, VIEWS, assert_refused, base64, in_json, output, send};
use crate::service::{Bounds, Service, incompressible_frame};

#[tokio::test]
async fn a_detector_returns_the_detections_of_each_view() {
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
async fn unusable_views_are_refused() {
    let service = Service::start();
    let views = |shape: Value, data: Value| json!({ "inputs": [{ "name": "views", "datatype": "UINT8", "shape": shape, "data": data }] });
    for (request, part) in [
        (
            views(json!([1, 3, 2, 2]), json!(vec![0; 12])),
            "send [views, 3, 64, 64]",
        ),
        (views(json!([0, 3, 64, 64]), json!([])), "at least one view"),
        (views(json!([12]), json!(vec![0; 12])), "[views, 3, 64, 64]"),
        (views(json!([1, 3, 64, 64]), json!(vec![0; 12])), "12288"),
        (in_json(&json!({})), "the only input is views"),
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
        &service.post("/v2/models/missing/infer", "{}").await,
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
async fn views_need_permits_and_bodies_have_limits() {
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
    assert_refused(&refused, 429, "overloaded", "the queue is full");
    let answer = service.post(FRAMES, &" ".repeat(100_001)).await;
    assert_refused(&answer, 413, "body-too-large", "100000");
    service.gate.panic_once();
    let answer = send(&service, VIEWS, &head, &[0; 12288]).await;
    assert_refused(&answer, 500, "internal", "failed");
    let answer = send(&service, VIEWS, &head, &[0; 12288]).await;
    assert_eq!(answer.status, 200, "the permit is free again");
}

#[tokio::test]
async fn unpacked_tensors_count_against_the_memory_budget() {
    let (numbers, frame) = (3 * 64 * 64, incompressible_frame());
    let views = |datatype: &str, data: Option<Vec<u8>>| {
        let mut input = json!({ "name": "views", "datatype": datatype, "shape": [1, 3, 64, 64] });
        match data {
            Some(data) => input["data"] = json!(data),
            None => input["parameters"] = json!({ "binary_data_size": numbers }),
        }
        json!({ "inputs": [input] })
    };
    let image =
        json!({ "name": "image", "datatype": "BYTES", "shape": [1], "data": [base64(&frame)] });
    let parameters = json!({ "calibration": "lobby", "profile": "fast" });
    let frames = json!({ "inputs": [image], "parameters": parameters });
    for (path, head, behind, unpacked) in [
        (VIEWS, views("UINT8", None), vec![7; numbers], 4 * numbers),
        (
            VIEWS,
            views("UINT8", Some(vec![7; numbers])),
            vec![],
            4 * numbers,
        ),
        (
            VIEWS,
            views("FP32", Some(vec![7; numbers])),
            vec![],
            4 * numbers,
        ),
        (FRAMES, frames, vec![], frame.len()),
    ] {
        // Memory for one body and its unpacked tensors, whose padding is not known in advance.
        let service = Service::within(&Bounds {
            max_upload_bytes: head.to_string().len() + behind.len() + unpacked + 8,
            ..Bounds::default()
        });
        service.gate.close();
        let (waiting, refused) = tokio::join!(send(&service, path, &head, &behind), async {
            service.gate.has_begun(1).await;
            let refused = send(&service, path, &head, &behind).await;
            service.gate.open();
            refused
        });
        assert_eq!(waiting.status, 200, "{}", waiting.text());
        assert_refused(&refused, 429, "overloaded", "bodies");
        assert_eq!(refused.header("retry-after"), "1");
        let answer = send(&service, path, &head, &behind).await;
        assert_eq!(answer.status, 200, "the memory is free again");
    }
}

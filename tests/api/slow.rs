//! Slow bodies and slow work. In most tests the clock is paused and advances only while all tasks
//! wait.

use std::{num::NonZeroU64, time::Duration};

use axum::{
    body::{Body, Bytes},
    http::Request,
};
use http_body_util::channel::{Channel, Sender};
use tokio::time::sleep;

use crate::service::{Answer, Bounds, Service};

/// Every route that reads a body.
const WITH_BODY: [(&str, &str); 3] = [
    ("POST", "/detect?profile=fast"),
    ("PUT", "/calibrations/lobby"),
    ("POST", "/v2/models/lookdown/infer"),
];
const CALIBRATION: &str = r#"{ "id": "lobby", "image": {"width": 200, "height": 200},
  "lens": {"model": "equidistant", "focal": 63.66, "cx": 99.5, "cy": 99.5, "max_theta": 1.5707} }"#;

fn request(method: &str, path: &str) -> (Request<Body>, Sender<Bytes, axum::Error>) {
    let (sender, channel) = Channel::new(1);
    let request = Request::builder().method(method).uri(path);
    (request.body(Body::new(channel)).unwrap(), sender)
}

#[track_caller]
fn assert_too_slow(answer: &Answer, part: &str) {
    assert_eq!(answer.status, 408);
    let problem = answer.problem();
    assert_eq!(problem["type"], "/problems/slow-upload");
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains(part), "{detail}");
    assert_eq!(answer.header("connection"), "close");
}

#[tokio::test(start_paused = true)]
async fn a_stalled_body_is_refused_after_seconds_on_every_route() {
    let service = Service::start();
    for (method, path) in WITH_BODY {
        let (request, mut sender) = request(method, path);
        sender.send_data(Bytes::from_static(b"{")).await.unwrap();
        let began = tokio::time::Instant::now();
        let answer = service.send(request).await;
        assert_too_slow(&answer, "1024 bytes per second");
        let waited = began.elapsed();
        let timeout = Duration::from_secs(5);
        assert!(
            (timeout..timeout * 2).contains(&waited),
            "{path}: {waited:?}"
        );
    }
    service.get("/livez").await;
}

#[tokio::test(start_paused = true)]
async fn without_a_minimum_rate_the_deadline_ends_the_wait() {
    let limit = Duration::from_mins(1);
    let service = Service::within(&Bounds {
        min_upload_bytes_per_second: None,
        request_timeout: limit,
        ..Bounds::default()
    });
    for (method, path) in WITH_BODY {
        let (request, _sender) = request(method, path);
        let began = tokio::time::Instant::now();
        let answer = service.send(request).await;
        assert_too_slow(&answer, "within 60 s");
        assert!(began.elapsed() >= limit, "{path}");
    }
}

/// Sends a calibration at this number of bytes per second.
async fn upload_at(bytes_per_second: usize) -> Answer {
    let service = Service::within(&Bounds {
        min_upload_bytes_per_second: NonZeroU64::new(10),
        request_timeout: Duration::from_mins(10),
        ..Bounds::default()
    });
    let (request, mut sender) = request("PUT", "/calibrations/lobby");
    let sending = tokio::spawn(async move {
        for part in CALIBRATION.as_bytes().chunks(bytes_per_second) {
            sleep(Duration::from_secs(1)).await;
            if sender.send_data(Bytes::from_static(part)).await.is_err() {
                return;
            }
        }
    });
    let answer = service.send(request).await;
    sending.await.unwrap();
    answer
}

#[tokio::test(start_paused = true)]
async fn a_steady_body_at_the_minimum_rate_is_accepted() {
    let fast_enough = upload_at(10).await;
    assert_eq!(fast_enough.status, 200, "{}", fast_enough.text());
    assert_too_slow(&upload_at(5).await, "10 bytes per second");
}

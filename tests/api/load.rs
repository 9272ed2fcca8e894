//! Overload, clients that disconnect, and internal errors.

use std::time::Duration;

use axum::{
    body::Body,
    http::{Request, StatusCode},
};
use tokio::task::JoinHandle;
use tower::ServiceExt;

use crate::service::{Bounds, Service, frame, incompressible_frame, with_host};

const FAST: &str = "calibration=lobby&profile=fast";
const VIEWS: &str = "/calibrations/lobby/views?profile=fast";

/// Sends a valid frame without waiting for the response.
fn begin(service: &Service, image: Vec<u8>) -> JoinHandle<StatusCode> {
    let request = Request::post(format!("/detect?{FAST}"));
    send(service, request.body(Body::from(image)).unwrap())
}

fn send(service: &Service, request: Request<Body>) -> JoinHandle<StatusCode> {
    let answer = service.router.clone().oneshot(with_host(request));
    tokio::spawn(async { answer.await.unwrap().status() })
}

/// Sends a request while a frame is processed, and disconnects before its turn.
async fn ask_and_leave(service: &Service, request: Request<Body>) {
    service.gate.close();
    let first = begin(service, frame());
    service.gate.has_begun(1).await;
    let leaving = send(service, request);
    while metric(service, "lookdown_pending_frames").await < 2 {
        tokio::task::yield_now().await;
    }
    leaving.abort();
    assert!(leaving.await.unwrap_err().is_cancelled());
    service.gate.open();
    assert_eq!(first.await.unwrap(), 200);
    service.still_works().await;
}

#[tokio::test]
async fn a_frame_beyond_the_queue_is_refused_at_once_and_may_retry() {
    let service = Service::within(&Bounds {
        frames_in_flight: 1,
        ..Bounds::default()
    });
    service.gate.close();
    let first = begin(&service, frame());
    service.gate.has_begun(1).await;
    let refused = service.post_raw(FAST, frame()).await;
    assert_eq!(refused.status, 429);
    assert_eq!(refused.header("retry-after"), "1");
    assert_eq!(refused.problem()["type"], "/problems/overloaded");
    service.gate.open();
    assert_eq!(first.await.unwrap(), 200);
    service.still_works().await;
}

#[tokio::test]
async fn all_bodies_together_stay_within_their_memory() {
    let image = incompressible_frame();
    let service = Service::within(&Bounds {
        max_upload_bytes: image.len() * 3 / 2,
        ..Bounds::default()
    });
    service.gate.close();
    let first = begin(&service, image.clone());
    service.gate.has_begun(1).await;
    let refused = service.post_raw(FAST, image.clone()).await;
    assert_eq!(refused.status, 429);
    assert!(
        refused.problem()["detail"]
            .as_str()
            .unwrap()
            .contains("bodies")
    );
    service.gate.open();
    assert_eq!(first.await.unwrap(), 200);
    assert_eq!(service.post_raw(FAST, image).await.status, 200);
}

#[tokio::test]
async fn a_view_plan_needs_a_permit_of_the_queue_or_may_retry() {
    let service = Service::within(&Bounds {
        frames_in_flight: 1,
        ..Bounds::default()
    });
    let trial = service.get("/calibrations/lobby").await.text();
    service.gate.close();
    let first = begin(&service, frame());
    service.gate.has_begun(1).await;
    for refused in [service.get(VIEWS).await, service.post(VIEWS, &trial).await] {
        assert_eq!(refused.status, 429);
        assert_eq!(refused.header("retry-after"), "1");
        assert_eq!(refused.problem()["type"], "/problems/overloaded");
    }
    service.gate.open();
    assert_eq!(first.await.unwrap(), 200);
    for plan in [service.get(VIEWS).await, service.post(VIEWS, &trial).await] {
        assert_eq!(plan.status, 200);
        assert_eq!(plan.header("content-type"), "application/json");
    }
}

#[tokio::test]
async fn a_view_plan_past_its_deadline_is_abandoned() {
    let service = Service::within(&Bounds {
        request_timeout: Duration::from_secs(1),
        ..Bounds::default()
    });
    service.gate.close();
    let first = begin(&service, frame());
    service.gate.has_begun(1).await;
    let late = service.get(VIEWS).await;
    assert_eq!(late.status, 504);
    let problem = late.problem();
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.starts_with("the view plan was not finished within 1 s"));
    assert_eq!(first.await.unwrap(), 504);
    service.gate.open();
}

#[tokio::test]
async fn a_view_plan_of_a_disconnected_client_is_not_built() {
    let service = Service::start();
    let request = Request::get(VIEWS).body(Body::empty()).unwrap();
    ask_and_leave(&service, request).await;
    assert_eq!(metric(&service, "lookdown_withdrawn_frames_total").await, 1);
}

#[tokio::test]
async fn a_frame_of_a_disconnected_client_is_not_processed() {
    let service = Service::start();
    let request = Request::post(format!("/detect?{FAST}"));
    ask_and_leave(&service, request.body(Body::from(frame())).unwrap()).await;
    assert_eq!(
        service.gate.runs(),
        4,
        "the frame of the client that left cost a run"
    );
    assert_eq!(metric(&service, "lookdown_withdrawn_frames_total").await, 1);
}

#[tokio::test]
async fn a_frame_past_its_deadline_is_abandoned() {
    let service = Service::within(&Bounds {
        request_timeout: Duration::from_millis(50),
        ..Bounds::default()
    });
    service.gate.close();
    let answer = service.post_raw(FAST, frame()).await;
    assert_eq!(answer.status, 504);
    assert_eq!(answer.problem()["type"], "/problems/timeout");
    service.gate.open();
}

#[tokio::test]
async fn a_request_may_set_a_shorter_timeout() {
    let service = Service::start();
    service.gate.close();
    let query = format!("{FAST}&timeout_millis=50");
    let answer = service.post_raw(&query, frame()).await;
    assert_eq!(answer.status, 504);
    let problem = answer.problem();
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains("within 0.05 s") && detail.ends_with("or raise timeout_millis"));
    service.gate.open();
}

#[tokio::test]
async fn a_panic_in_the_detector_fails_one_request_without_details() {
    let service = Service::start();
    service.gate.panic_once();
    let answer = service.post_raw(FAST, frame()).await;
    assert_eq!(answer.status, 500);
    assert_eq!(answer.problem()["type"], "/problems/internal");
    assert!(!answer.text().contains("secret"));
    service.still_works().await;
}

async fn metric(service: &Service, name: &str) -> usize {
    let metrics = service.get("/metrics").await.text();
    let mut lines = metrics.lines();
    let line = lines.find(|line| line.split(' ').next() == Some(name));
    line.unwrap().rsplit(' ').next().unwrap().parse().unwrap()
}

//! More than the service can do, clients that leave, and faults of its own.

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

/// Sends a good frame and does not wait for the answer.
fn begin(service: &Service, image: Vec<u8>) -> JoinHandle<StatusCode> {
    let request = Request::post(format!("/detect?{FAST}"));
    send(service, request.body(Body::from(image)).unwrap())
}

fn send(service: &Service, request: Request<Body>) -> JoinHandle<StatusCode> {
    let answer = service.router.clone().oneshot(with_host(request));
    tokio::spawn(async { answer.await.unwrap().status() })
}

/// Somebody asks while a frame is worked on, and leaves before it is his turn.
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
async fn a_frame_without_a_place_is_refused_at_once_and_may_retry() {
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
async fn a_view_plan_has_a_place_among_the_frames_or_may_retry() {
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
async fn a_view_plan_that_has_no_turn_in_time_is_given_up() {
    let service = Service::within(&Bounds {
        request_timeout: Duration::from_millis(50),
        ..Bounds::default()
    });
    service.gate.close();
    let first = begin(&service, frame());
    service.gate.has_begun(1).await;
    let late = service.get(VIEWS).await;
    assert_eq!(late.status, 504);
    let problem = late.problem();
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.starts_with("the view plan was not made within 0.05 s"));
    assert_eq!(first.await.unwrap(), 504);
    service.gate.open();
}

#[tokio::test]
async fn a_view_plan_whose_client_left_is_never_made() {
    let service = Service::start();
    let request = Request::get(VIEWS).body(Body::empty()).unwrap();
    ask_and_leave(&service, request).await;
    assert_eq!(metric(&service, "lookdown_withdrawn_frames_total").await, 1);
}

#[tokio::test]
async fn a_frame_whose_client_left_is_not_worked_on() {
    let service = Service::start();
    let request = Request::post(format!("/detect?{FAST}"));
    ask_and_leave(&service, request.body(Body::from(frame())).unwrap()).await;
    assert_eq!(
        service.gate.runs(),
        2,
        "the frame of the client that left cost a run"
    );
    assert_eq!(metric(&service, "lookdown_withdrawn_frames_total").await, 1);
}

#[tokio::test]
async fn a_frame_that_takes_too_long_is_given_up() {
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
async fn a_request_may_ask_for_a_shorter_time() {
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
async fn a_panic_in_the_detector_costs_one_answer_and_reveals_nothing() {
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

//! Health checks, metrics and the API page.

use std::time::Duration;

use axum::{body::Body, http::Request};
use lookdown::api::{Companions, Readiness};
use tower::ServiceExt;

use crate::service::{Bounds, Service, frame, with_host};

#[tokio::test]
async fn readiness_follows_the_phase_and_liveness_does_not() {
    let service = Service::start();
    assert_eq!(service.get("/readyz").await.json()["status"], "ready");
    service.readiness.stopping();
    let answer = service.get("/readyz").await;
    assert_eq!(answer.status, 503);
    assert_eq!(answer.problem()["type"], "/problems/shutting-down");
    assert_eq!(answer.header("retry-after"), "1");
    assert_eq!(service.get("/livez").await.status, 200);
}

#[tokio::test]
async fn readiness_fails_without_progress_and_recovers_with_it() {
    let service = Service::within(&Bounds {
        request_timeout: Duration::from_millis(20),
        ..Bounds::default()
    });
    service.gate.close();
    let path = "/detect?calibration=lobby&profile=fast";
    // A frame that times out before it reaches the only worker holds nothing, so it is sent again.
    let refused = loop {
        let request = Request::post(path).body(Body::from(frame())).unwrap();
        let stuck = service.router.clone().oneshot(with_host(request));
        assert!(stuck.await.unwrap().status().is_server_error());
        let answer = service.get("/readyz").await;
        if answer.status != 200 {
            break answer;
        }
    };
    assert_eq!(refused.status, 503);
    assert_eq!(refused.problem()["type"], "/problems/stalled");
    assert_eq!(service.get("/v2/health/ready").await.status, 503);
    assert_eq!(service.get("/livez").await.status, 200);
    service.gate.open();
    while service.get("/readyz").await.status != 200 {
        tokio::task::yield_now().await;
    }
}

#[test]
fn a_warm_up_that_ends_during_shutdown_does_not_make_it_ready() {
    let readiness = Readiness::default();
    readiness.stopping();
    readiness.warmed_up();
    assert_eq!(readiness.phase(), lookdown::api::Phase::Stopping);
}

#[tokio::test]
async fn metrics_count_frames_views_persons_and_failures() {
    let service = Service::start();
    service
        .post_raw("calibration=lobby&profile=fast", frame())
        .await;
    service.post_raw("sigma=0", frame()).await;
    service.get("/made/up/path").await;
    let answer = service.get("/metrics").await;
    assert!(answer.header("content-type").starts_with("text/plain"));
    let metrics = answer.text();
    for line in [
        "lookdown_http_requests_total{method=\"POST\",route=\"/detect\",status=\"2xx\"} 1",
        "lookdown_http_requests_total{method=\"POST\",route=\"/detect\",status=\"4xx\"} 1",
        "lookdown_http_requests_total{method=\"GET\",route=\"unmatched\",status=\"4xx\"} 1",
        "lookdown_request_failures_total{reason=\"invalid-parameter\"} 1",
        "lookdown_request_failures_total{reason=\"overloaded\"} 0",
        "lookdown_request_duration_seconds_count{model=\"eager\",profile=\"fast\"} 1",
        "lookdown_queue_duration_seconds_count{model=\"eager\",profile=\"fast\"} 1",
        "lookdown_compute_input_duration_seconds_count{model=\"eager\",profile=\"fast\"} 1",
        "lookdown_compute_infer_duration_seconds_count{model=\"eager\",profile=\"fast\"} 1",
        "lookdown_compute_output_duration_seconds_count{model=\"eager\",profile=\"fast\"} 1",
        "lookdown_views_total 9",
        "lookdown_batches_total 2",
        "lookdown_pending_frames 0",
        "lookdown_rig_cache_rigs 1",
        "lookdown_rig_cache_builds_total 1",
        "lookdown_rig_cache_evictions_total 0",
    ] {
        assert!(
            metrics.lines().any(|reported| reported == line),
            "{line} is not in\n{metrics}"
        );
    }
    assert!(
        !metrics.contains("made"),
        "a path that a client made up became a label"
    );
}

#[tokio::test]
async fn the_api_page_loads_nothing_from_other_hosts() {
    let service = Service::start();
    let page = service.get("/docs/").await.text();
    assert!(page.contains("swagger-ui"), "{page}");
    assert!(
        !page.contains("http"),
        "the page loads from other hosts: {page}"
    );
    let script = service.get("/docs/swagger-initializer.js").await.text();
    assert!(script.contains("\"../openapi.json\""), "{script}");
    assert_eq!(service.get("/docs/swagger-ui-bundle.js").await.status, 200);
}

#[tokio::test]
async fn the_server_serves_its_openapi_document() {
    let companions = Companions::default();
    let service = Service::within(&Bounds {
        companions: companions.clone(),
        ..Bounds::default()
    });
    for has_counts in [false, true] {
        let document = service.get("/openapi.json").await.json();
        assert!(document["paths"]["/detect"]["post"].is_object());
        let counts = [
            "/counts/{camera}",
            "/sites/{site}",
            "/cameras/{camera}/furniture",
        ];
        for path in counts {
            let is_there = document["paths"][path]["get"].is_object();
            assert_eq!(is_there, has_counts, "{path}");
        }
        let tags = document["tags"].as_array().unwrap();
        let names: std::collections::BTreeSet<_> =
            tags.iter().map(|tag| tag["name"].as_str()).collect();
        assert_eq!(names.len(), tags.len());
        let schemas = document["components"]["schemas"].as_object().unwrap();
        assert!(schemas.contains_key("CameraRow"));
        assert_eq!(schemas.contains_key("CountedCamera"), has_counts);
        companions.expect_counts(lookdown_count::openapi_document);
    }
}

//! Readiness while no frame makes progress.

use std::time::Duration;

use axum::{body::Body, http::Request};
use tower::ServiceExt;

use crate::service::{Bounds, Service, frame, with_host};

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

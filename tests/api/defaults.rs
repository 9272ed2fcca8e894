//! Defaults of detection parameters, of a camera and of the server.

use lookdown_detect::parameters::DetectDefaults;
use serde_json::{Value, json};

use crate::service::{Bounds, Service, frame};

/// The calibration `hall` with these defaults.
fn hall(detect: &Value) -> String {
    json!({
        "id": "hall", "image": { "width": 200, "height": 200 },
        "lens": { "model": "equidistant", "focal": 63.66, "cx": 99.5, "cy": 99.5,
            "max_theta": 1.5 },
        "detect": detect,
    })
    .to_string()
}

fn service() -> Service {
    let server = [("profile", "fast"), ("score_threshold", "0.6")];
    Service::within(&Bounds {
        detect_defaults: DetectDefaults::parse(server).unwrap(),
        ..Bounds::default()
    })
}

#[tokio::test]
async fn request_precedes_calibration_and_calibration_the_server() {
    let service = service();
    let detect = json!({"score_threshold": 0.5, "motion": true, "max_detections": 7});
    let put = service.put("/calibrations/hall", &hall(&detect)).await;
    assert_eq!(put.status, 201, "{}", put.text());
    let stored = service.get("/calibrations/hall").await.json();
    assert_eq!(stored["detect"], detect);

    let report = service.post_raw("calibration=hall", frame()).await.json();
    assert_eq!(report["profile"], "fast");
    assert_eq!(report["refinement"]["score_threshold"], 0.5);
    assert_eq!(report["refinement"]["max_detections"], 7);
    let of = |name: &str, value: &str, source: &str| json!({"name": name, "value": value, "source": source});
    let expected = json!([
        of("max_detections", "7", "calibration"),
        of("motion", "true", "calibration"),
        of("score_threshold", "0.5", "calibration"),
        of("profile", "fast", "server"),
    ]);
    assert_eq!(report["defaults"], expected);
    // The frame is the same as before, so motion detection skips all views.
    let again = service.post_raw("calibration=hall", frame()).await.json();
    assert_eq!(again["views"]["inferred"], 0, "{again}");

    let query = "calibration=hall&score_threshold=0.7&motion=false&profile=direct";
    let report = service.post_raw(query, frame()).await.json();
    assert_eq!(report["refinement"]["score_threshold"], 0.7);
    assert_eq!(report["profile"], "direct");
    assert_eq!(report["defaults"].as_array().unwrap().len(), 1);
}

#[tokio::test]
async fn the_default_of_follow_is_in_v2() {
    let follow = DetectDefaults::parse([("follow", "true")]).unwrap();
    let service = Service::within(&Bounds {
        detect_defaults: follow,
        ..Bounds::default()
    });
    assert_eq!(service.get("/v2").await.json()["follow"], true);
}

#[tokio::test]
async fn searches_of_frames_are_counted_from_zero() {
    let service = Service::start();
    let rows = |search: &str, count: u64| {
        format!("lookdown_frame_searches_total{{search=\"{search}\"}} {count}\n")
    };
    let metrics = service.get("/metrics").await.text();
    for search in ["full", "followed", "unchanged"] {
        assert!(metrics.contains(&rows(search, 0)), "{search}: {metrics}");
    }
    service.post_raw("", frame()).await;
    let metrics = service.get("/metrics").await.text();
    assert!(metrics.contains(&rows("full", 1)), "{metrics}");
}

#[tokio::test]
async fn a_camera_uses_the_calibration_of_the_same_name() {
    let service = service();
    let before = service.post_raw("camera=hall", frame()).await.json();
    assert_eq!(before["calibration"]["assumed"], true, "{before}");
    let detect = json!({"score_threshold": 0.5});
    let put = service.put("/calibrations/hall", &hall(&detect)).await;
    assert_eq!(put.status, 201, "{}", put.text());
    let after = service.post_raw("camera=hall", frame()).await.json();
    assert_eq!(after["calibration"]["id"], "hall", "{after}");
    assert_eq!(after["calibration"]["assumed"], false);
    assert_eq!(after["refinement"]["score_threshold"], 0.5);
}

#[tokio::test]
async fn invalid_defaults_of_a_calibration_are_refused() {
    let service = Service::start();
    for (detect, field) in [
        (json!({"profile": "best"}), "detect.profile"),
        (json!({"score_threshold": 2}), "detect.score_threshold"),
        (json!({"camera": "hall"}), "detect.camera"),
        (json!({"priority": 1}), "detect.priority"),
        (json!({"model": "m".repeat(200)}), "detect.model"),
    ] {
        let refused = service.put("/calibrations/hall", &hall(&detect)).await;
        assert_eq!(refused.status, 422, "{detect}");
        assert_eq!(refused.problem()["parameter"], field);
    }
    assert_eq!(service.get("/calibrations/hall").await.status, 404);
}

#[tokio::test]
async fn unnamed_frames_are_stored_on_request_only() {
    let service = Service::start();
    let cameras = async || service.get("/results").await.json();
    for (query, stored) in [
        ("profile=fast", 0),
        ("profile=fast&camera=web-page&store=false", 0),
        ("profile=fast&calibration=lobby&store=false", 0),
        ("profile=fast&store=true", 1),
        ("profile=fast&calibration=lobby", 2),
    ] {
        let answer = service.post_raw(query, frame()).await;
        assert_eq!(answer.status, 200, "{}", answer.text());
        assert_eq!(cameras().await.as_array().unwrap().len(), stored, "{query}");
    }
    assert_eq!(cameras().await[0]["camera"], "assumed");
}

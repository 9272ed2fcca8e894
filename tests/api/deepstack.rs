//! The DeepStack API.

use std::sync::Arc;

use axum::{body::Body, http::Request};
use lookdown::{
    access::{AccessKeys, KeyDigest},
    api::Access,
};
use serde_json::Value;
use tower::ServiceExt;

use crate::{
    log::Log,
    service::{
        Answer, Bounds, FRAME_SIDE, Service, form_to, frame, incompressible_frame, with_host,
    },
};

const ANYWHERE: &str = "/v1/vision/detection";
const LOBBY: &str = "/v1/vision/custom/lobby";
const LIST: &str = "/v1/vision/custom/list";
const KEY: &str = "lookdown_home_assistant";

async fn post(service: &Service, path: &str, parts: &[(&str, &[u8])]) -> Answer {
    service.send(form_to(path, parts)).await
}

/// Asserts a problem of this status that DeepStack's clients understand, too.
#[track_caller]
fn assert_refused(answer: &Answer, status: u16, kind: &str, part: &str) {
    assert_eq!(answer.status, status, "{}", answer.text());
    let problem = answer.problem();
    assert_eq!(problem["success"], false);
    assert_eq!(problem["type"], format!("/problems/{kind}"));
    let error = problem["error"].as_str().unwrap();
    assert!(error.contains(part), "{error}");
}

/// A service with one key of this scope.
fn guarded(scope: &str) -> Service {
    guarded_within(scope, Bounds::default())
}

fn guarded_within(scope: &str, bounds: Bounds) -> Service {
    let digest = KeyDigest::new(KEY.as_bytes()).hexadecimal();
    let keys = format!("home:{scope}:{digest}").parse().unwrap();
    Service::within(&Bounds {
        access: Access::Keys(Arc::new(AccessKeys::open(keys, None).unwrap())),
        ..bounds
    })
}

#[tokio::test]
async fn deepstack_detection_returns_the_persons_of_detect() {
    let service = Service::start();
    let image = frame();
    let answer = post(
        &service,
        LOBBY,
        &[("image", &image), ("min_confidence", b"0.3")],
    )
    .await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert_eq!(answer.header("content-type"), "application/json");
    let answer = answer.json();
    assert_eq!(answer["success"], true);
    let seconds = answer["duration"].as_f64().unwrap();
    assert!((0.0..20.0).contains(&seconds), "{seconds}");

    let report = service.post_raw("calibration=lobby", image).await.json();
    let persons = report["persons"].as_array().unwrap();
    let predictions = answer["predictions"].as_array().unwrap();
    assert_eq!(predictions.len(), persons.len());
    assert!(!predictions.is_empty());
    for (prediction, person) in predictions.iter().zip(persons) {
        assert_eq!(prediction["label"], "person");
        assert_eq!(prediction["confidence"], person["score"]);
        for (edge, outwards) in [
            ("x_min", -1.0),
            ("y_min", -1.0),
            ("x_max", 1.0),
            ("y_max", 1.0),
        ] {
            let whole = prediction[edge].as_i64().unwrap();
            assert!((0..=i64::from(FRAME_SIDE)).contains(&whole), "{prediction}");
            let exact = person["box"][edge].as_f64().unwrap();
            let beyond = (f64::from(i32::try_from(whole).unwrap()) - exact) * outwards;
            assert!(
                (0.0..1.0).contains(&beyond),
                "{edge}: {prediction} {person}"
            );
        }
    }
}

#[tokio::test]
async fn reports_are_stored_under_the_name_of_their_camera() {
    let service = Service::start();
    let named = format!("{ANYWHERE}?camera=hall");
    for path in [ANYWHERE, &named, LOBBY] {
        let answer = post(&service, path, &[("image", &frame())]).await;
        assert_eq!(answer.status, 200, "{}", answer.text());
    }
    let cameras = service.get("/results").await.json();
    let cameras: Vec<_> = cameras.as_array().unwrap().iter().collect();
    let listed: Vec<_> = cameras.iter().map(|row| &row["camera"]).collect();
    assert_eq!(listed, [&Value::from("hall"), &Value::from("lobby")]);
    let metrics = service.get("/metrics").await.text();
    assert!(
        metrics.contains("lookdown_results_stored_total 2"),
        "{metrics}"
    );
    let route = "route=\"/v1/vision/custom/{calibration}\"";
    assert!(metrics.contains(route), "{metrics}");
}

#[tokio::test]
async fn the_default_min_confidence_is_that_of_deepstack() {
    let service = Service::start();
    for (sent, used) in [
        (None, 0.4),
        (Some(&b""[..]), 0.4),
        (Some(b"0.8"), 0.8),
        (Some(b"1"), 1.0),
    ] {
        let image = frame();
        let mut parts: Vec<(&str, &[u8])> = vec![("image", &image)];
        parts.extend(sent.map(|sent| ("min_confidence", sent)));
        assert_eq!(post(&service, LOBBY, &parts).await.status, 200);
        let report = service.get("/results/lobby/latest").await.json();
        assert_eq!(report["refinement"]["score_threshold"], used);
    }
}

#[tokio::test]
async fn a_min_confidence_of_zero_has_bounded_cost() {
    let service = Service::start();
    service.gate.crowd(299);
    for path in [ANYWHERE, LOBBY] {
        let answer = post(
            &service,
            path,
            &[("image", &frame()), ("min_confidence", b"0")],
        )
        .await;
        assert_eq!(answer.status, 200, "{}", answer.text());
        let persons = answer.json()["predictions"].as_array().unwrap().len();
        assert!((1..=1000).contains(&persons), "{persons}");
    }
    service.still_works().await;
}

#[tokio::test]
async fn the_query_has_the_parameters_of_detect() {
    let service = Service::start();
    let path = format!("{LOBBY}?camera=hall&profile=fast&refine=nms&score_threshold=0.7");
    let answer = post(&service, &path, &[("image", &frame())]).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    let report = service.get("/results/hall/latest").await.json();
    assert_eq!(report["calibration"]["id"], "lobby");
    assert_eq!(report["profile"], "fast");
    assert_eq!(report["refinement"]["name"], "nms");
    assert_eq!(report["refinement"]["score_threshold"], 0.7);
}

#[tokio::test]
async fn unknown_or_repeated_query_parameters_are_refused() {
    let service = Service::start();
    for (query, name) in [
        ("colour=red", "colour"),
        ("draw=boxes", "draw"),
        ("calibration=lobby", "calibration"),
        ("profile=quick", "profile"),
    ] {
        let answer = post(
            &service,
            &format!("{LOBBY}?{query}"),
            &[("image", &frame())],
        )
        .await;
        assert_eq!(answer.status, 400, "{}", answer.text());
        assert_eq!(answer.problem()["parameter"], name);
    }
    let image = frame();
    let parts: [(&str, &[u8]); 2] = [("image", &image), ("min_confidence", b"0.5")];
    let answer = post(&service, &format!("{LOBBY}?score_threshold=0.7"), &parts).await;
    assert_eq!(answer.status, 400, "{}", answer.text());
}

#[tokio::test]
async fn status_routes_of_code_project_ai_need_no_key() {
    let service = guarded("detect");
    for path in ["/v1/status/ping", "/v1/server/status/ping"] {
        let answer = service.get(path).await;
        assert_eq!(answer.status, 200, "{}", answer.text());
        assert_eq!(answer.json(), serde_json::json!({"success": true}));
    }
    let answer = service.get("/v1/status/updateavailable").await.json();
    assert_eq!(answer["updateAvailable"], false);
}

#[tokio::test]
async fn answers_have_the_fields_of_code_project_ai() {
    let service = Service::start();
    let answer = post(&service, LOBBY, &[("image", &frame())]).await.json();
    let persons = answer["predictions"].as_array().unwrap().len();
    assert!(persons > 0);
    assert_eq!(answer["count"], persons);
    assert_eq!(answer["message"], "Found person");
    assert_eq!(answer["command"], "detect");
    let millis = ["inferenceMs", "processMs", "analysisRoundTripMs"];
    let millis = millis.map(|name| answer[name].as_i64().unwrap());
    assert!(
        millis[0] <= millis[1] && millis[1] == millis[2],
        "{millis:?}"
    );
}

#[tokio::test]
async fn unknown_fields_are_ignored() {
    let service = Service::start();
    let image = frame();
    let parts: [(&str, &[u8]); 4] = [
        ("userid", b"anonymous"),
        ("image\"; filename=\"image", &image),
        ("admin_key", b"\xff\xfe"),
        ("api_key", b""),
    ];
    let answer = post(&service, LOBBY, &parts).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
}

#[tokio::test]
async fn invalid_frames_and_fields_have_the_statuses_of_deepstack() {
    let service = Service::start();
    let good = frame();
    let cut = &good[..good.len() - 20];
    for (parts, kind, part) in [
        (
            &[("min_confidence", &b"0.4"[..])][..],
            "missing-image",
            "frame",
        ),
        (&[("image", b"")], "missing-image", "image"),
        (&[("image", b"GIF89a or so")], "unsupported-image", "image"),
        (&[("image", cut)], "damaged-image", "image"),
        (
            &[("image", &good), ("image", &good)],
            "repeated-parameter",
            "two frames",
        ),
        (
            &[("image", &good), ("min_confidence", b"1.5")],
            "invalid-parameter",
            "min_confidence: \"1.5\"",
        ),
        (
            &[("image", &good), ("min_confidence", b"-1")],
            "invalid-parameter",
            "min_confidence: \"-1\"",
        ),
        (
            &[("image", &good), ("min_confidence", b"NaN")],
            "invalid-parameter",
            "min_confidence",
        ),
        (
            &[("image", &good), ("min_confidence", b"40%")],
            "invalid-parameter",
            "min_confidence",
        ),
        (
            &[
                ("image", &good),
                ("min_confidence", b"0"),
                ("min_confidence", b"1"),
            ],
            "repeated-parameter",
            "min_confidence",
        ),
    ] {
        assert_refused(&post(&service, LOBBY, parts).await, 400, kind, part);
    }
    let raw = Request::post(ANYWHERE)
        .body(Body::from(good.clone()))
        .unwrap();
    assert_refused(&service.send(raw).await, 400, "missing-image", "form");
    for path in ["/v1/vision/custom/missing", "/v1/vision/custom/No%20ID"] {
        let answer = post(&service, path, &[("image", &good)]).await;
        assert_refused(&answer, 404, "unknown-calibration", "");
    }
    let answer = post(&service, "/v1/vision/face", &[("image", &good)]).await;
    assert_refused(&answer, 404, "not-found", "/v1/vision/face");
    assert_refused(
        &service.get(ANYWHERE).await,
        405,
        "method-not-allowed",
        "GET",
    );
    service.still_works().await;
}

#[tokio::test]
async fn other_routes_have_no_member_success() {
    let answer = Service::start().post_raw("", b"no image".to_vec()).await;
    assert_eq!(answer.status, 415);
    assert!(answer.problem()["success"].is_null());
}

#[tokio::test]
async fn a_frame_past_its_deadline_is_a_server_error() {
    let service = Service::within(&Bounds {
        request_timeout: std::time::Duration::from_millis(300),
        ..Bounds::default()
    });
    service.gate.close();
    let answer = post(&service, LOBBY, &[("image", &frame())]).await;
    service.gate.open();
    assert_refused(&answer, 500, "timeout", "server.request_timeout_millis");
}

#[tokio::test]
async fn frames_share_the_queue_of_other_routes() {
    let service = Service::within(&Bounds {
        frames_in_flight: 1,
        ..Bounds::default()
    });
    service.gate.close();
    let waiting = form_to(LOBBY, &[("image", &frame())]);
    let first = tokio::spawn({
        let router = service.router.clone();
        async move {
            tower::ServiceExt::oneshot(router, with_host(waiting))
                .await
                .unwrap()
                .status()
        }
    });
    service.gate.has_begun(1).await;
    let answer = post(&service, ANYWHERE, &[("image", &frame())]).await;
    assert_refused(&answer, 429, "overloaded", "frames");
    assert!(!answer.header("retry-after").is_empty());
    service.gate.open();
    assert_eq!(first.await.unwrap(), 200);
}

#[tokio::test]
async fn the_key_is_in_the_form_or_in_a_header_but_not_in_both() {
    let service = guarded("detect");
    let image = frame();
    let image: (&str, &[u8]) = ("image", &image);
    let log = Log::start();
    let in_form = ("api_key", KEY.as_bytes());
    assert_eq!(post(&service, LOBBY, &[image, in_form]).await.status, 200);
    assert_eq!(
        post(&service, ANYWHERE, &[in_form, image]).await.status,
        200
    );

    let with_header = |parts: &[(&str, &[u8])]| {
        let mut request = form_to(LOBBY, parts);
        request
            .headers_mut()
            .insert("x-api-key", KEY.parse().unwrap());
        request
    };
    for parts in [&[image][..], &[image, ("api_key", b"")]] {
        assert_eq!(service.send(with_header(parts)).await.status, 200);
    }
    let twice = service.send(with_header(&[image, in_form])).await;
    assert_refused(&twice, 401, "key-required", "more than one key");

    for parts in [
        &[image][..],
        &[image, ("api_key", b"")],
        &[image, ("api_key", b"lookdown_stranger")],
        &[image, ("api_key", &KEY.as_bytes()[1..])],
    ] {
        let answer = post(&service, LOBBY, parts).await;
        assert_refused(&answer, 401, "key-required", "key");
        assert_eq!(answer.header("www-authenticate"), "Bearer");
    }
    let raw = Request::post(LOBBY).body(Body::from(frame())).unwrap();
    assert_refused(&service.send(raw).await, 401, "key-required", "key");
    let answer = post(&service, LOBBY, &[image, in_form, in_form]).await;
    assert_refused(&answer, 400, "repeated-parameter", "api_key");
    assert!(!log.text().contains(KEY), "{}", log.text());
}

#[tokio::test]
async fn forms_without_a_known_key_leave_memory_to_others() {
    let image = incompressible_frame();
    let service = guarded_within(
        "detect",
        Bounds {
            // The share of one client in forms with the key inside holds one of them.
            max_upload_bytes: 8 * image.len() * 3,
            ..Bounds::default()
        },
    );
    let parts = [("image", &image[..]), ("api_key", KEY.as_bytes())];
    service.gate.close();
    let router = service.router.clone();
    let first = tokio::spawn(router.oneshot(with_host(form_to(LOBBY, &parts))));
    service.gate.has_begun(1).await;
    for parts in [&parts[..], &parts[..1]] {
        let refused = post(&service, LOBBY, parts).await;
        assert_refused(&refused, 429, "overloaded", "send the key in a header");
    }
    let mut request = form_to(LOBBY, &parts[..1]);
    let key = KEY.parse().unwrap();
    request.headers_mut().insert("x-api-key", key);
    let with_header = tokio::spawn(service.router.clone().oneshot(with_host(request)));
    service.gate.open();
    assert_eq!(first.await.unwrap().unwrap().status(), 200);
    assert_eq!(with_header.await.unwrap().unwrap().status(), 200);
}

#[tokio::test]
async fn a_key_of_another_scope_is_not_enough() {
    let service = guarded("read");
    let image = frame();
    let parts = [("image", &image[..]), ("api_key", KEY.as_bytes())];
    let answer = post(&service, LOBBY, &parts).await;
    assert_refused(&answer, 403, "forbidden", "detect");
}

#[tokio::test]
async fn calibrations_in_use_are_listed_as_models() {
    let service = Service::start();
    std::fs::write(service.folder.path().join("broken.json"), "{").unwrap();
    service.calibrations.refresh();
    let expected = serde_json::json!({"success": true, "models": ["lobby"]});
    for answer in [service.post(LIST, "").await, service.get(LIST).await] {
        assert_eq!(answer.status, 200);
        assert_eq!(answer.json(), expected);
    }
}

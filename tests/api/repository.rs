//! Loading and unloading models over HTTP.

use std::fs;

use axum::http::StatusCode;
use lookdown::api::Access;
use serde_json::json;

use crate::service::{Bounds, Service, frame, with_host};

const INDEX: &str = "/v2/repository/index";

/// Adds a model to the folder of the service.
fn add(service: &Service, name: &str) {
    let folder = service.folder.path().join("models").join(name);
    fs::create_dir_all(&folder).unwrap();
    let manifest = format!("name = \"{name}\"\nonnx = \"model.onnx\"\n");
    fs::write(folder.join("model.toml"), manifest).unwrap();
    fs::write(folder.join("model.onnx"), "weights").unwrap();
}

fn path(name: &str, verb: &str) -> String {
    format!("/v2/repository/models/{name}/{verb}")
}

#[tokio::test]
async fn a_model_can_be_loaded_used_by_name_and_unloaded() {
    let service = Service::start();
    add(&service, "other");
    let query = "calibration=lobby&profile=fast&model=other";
    let answer = service.post_raw(query, frame()).await;
    assert_eq!(answer.status, 404);
    let problem = answer.problem();
    assert_eq!(problem["type"], "/problems/unknown-model");
    let detail = problem["detail"].as_str().unwrap();
    assert!(
        detail.contains("\"other\"") && detail.contains("eager"),
        "{detail}"
    );

    let loaded = service.post(&path("other", "load"), "").await;
    let entry = json!({ "name": "other", "version": "1", "state": "READY" });
    assert_eq!((loaded.status, loaded.json()), (StatusCode::OK, entry));
    let report = service.post_raw(query, frame()).await.json();
    assert_eq!(report["model"], json!({ "name": "other", "revision": "1" }));

    let body = r#"{"parameters": {"unload_dependents": false}}"#;
    let unloaded = service.post(&path("other", "unload"), body).await;
    let entry = json!({ "name": "other", "state": "UNAVAILABLE" });
    assert_eq!((unloaded.status, unloaded.json()), (StatusCode::OK, entry));
    assert_eq!(service.post_raw(query, frame()).await.status, 404);
    service.still_works().await;
}

#[tokio::test]
async fn the_index_lists_loaded_and_loadable_models() {
    let service = Service::start();
    add(&service, "other");
    let all = service.post(INDEX, "").await.json();
    assert_eq!(
        all[0],
        json!({ "name": "eager", "version": "1", "state": "READY" })
    );
    assert_eq!(
        (&all[1]["name"], &all[1]["state"]),
        (&json!("other"), &json!("UNAVAILABLE"))
    );
    assert!(
        all[1]["reason"]
            .as_str()
            .unwrap()
            .contains("/v2/repository/models/other/load")
    );
    let ready = service.post(INDEX, r#"{"ready": true}"#).await.json();
    assert_eq!(ready.as_array().unwrap().len(), 1);
}

#[tokio::test]
async fn an_invalid_model_is_reported_and_the_old_one_stays_in_use() {
    let service = Service::start();
    add(&service, "other");
    service.post(&path("other", "load"), "").await;
    fs::write(service.folder.path().join("models/other/broken"), "").unwrap();
    let answer = service.post(&path("other", "load"), "").await;
    assert_eq!(answer.status, 422);
    let problem = answer.problem();
    assert_eq!(problem["type"], "/problems/model-refused");
    assert!(problem["detail"].as_str().unwrap().contains("it is broken"));
    let query = "calibration=lobby&profile=fast&model=other";
    assert_eq!(service.post_raw(query, frame()).await.status, 200);
    let index = service.post(INDEX, "").await.json();
    assert_eq!(index[1]["state"], "READY");
    assert!(
        index[1]["reason"]
            .as_str()
            .unwrap()
            .contains("it is broken")
    );

    let metrics = service.get("/metrics").await.text();
    for line in [
        "lookdown_model_info{model=\"eager\",revision=\"1\"} 1",
        "lookdown_model_info{model=\"other\",revision=\"1\"} 1",
        "lookdown_model_loads_total{result=\"failure\"} 1",
        "lookdown_model_loads_total{result=\"success\"} 2",
    ] {
        assert!(
            metrics.lines().any(|reported| reported == line),
            "{line} is not in\n{metrics}"
        );
    }
}

#[tokio::test]
async fn impossible_changes_are_refused_with_the_reason() {
    let service = Service::start();
    for (path, body, status, kind) in [
        (path("nothing", "load"), "", 404, "unknown-model"),
        (path("..", "load"), "", 404, "unknown-model"),
        (path("nothing", "unload"), "", 404, "unknown-model"),
        (path("eager", "unload"), "", 409, "model-conflict"),
        (
            path("eager", "load"),
            r#"{"parameters": {"config": "{}"}}"#,
            400,
            "malformed-request",
        ),
        (INDEX.to_owned(), "not JSON", 400, "malformed-request"),
        (INDEX.to_owned(), "[]", 400, "malformed-request"),
        (
            INDEX.to_owned(),
            r#"{"redy": true}"#,
            400,
            "malformed-request",
        ),
    ] {
        let answer = service.post(&path, body).await;
        assert_eq!(answer.status, status, "{path} {body}");
        let urn = format!("/problems/{kind}");
        assert_eq!(answer.problem()["type"], urn, "{path} {body}");
    }
    for nothing in ["", "null", "{}"] {
        assert_eq!(service.post(INDEX, nothing).await.status, 200, "{nothing}");
    }
    let long = " ".repeat(100_000);
    let answer = service.post(INDEX, &long).await;
    assert_eq!(answer.status, 413);
    assert_eq!(answer.problem()["type"], "/problems/body-too-large");
}

#[tokio::test]
async fn one_model_is_loaded_at_a_time() {
    let service = Service::start();
    service.gate.close();
    let router = service.router.clone();
    let first = tokio::spawn(async move {
        let request = axum::http::Request::post(path("eager", "load"));
        let request = request.body(axum::body::Body::empty()).unwrap();
        tower::ServiceExt::oneshot(router, with_host(request))
            .await
            .unwrap()
            .status()
    });
    service.gate.has_begun(1).await;
    let second = service.post(&path("eager", "load"), "").await;
    assert_eq!(
        (second.status.as_u16(), second.header("retry-after")),
        (429, "1")
    );
    assert_eq!(second.problem()["type"], "/problems/model-busy");
    service.gate.open();
    assert_eq!(first.await.unwrap(), 200);
}

#[tokio::test]
async fn a_remotely_reachable_server_without_keys_changes_no_models() {
    let service = Service::within(&Bounds {
        access: Access::Open {
            own_machine_only: false,
        },
        ..Bounds::default()
    });
    for path in [
        INDEX.to_owned(),
        path("eager", "load"),
        path("eager", "unload"),
    ] {
        let answer = service.post(&path, "").await;
        assert_eq!(answer.status, 403);
        assert_eq!(answer.problem()["type"], "/problems/forbidden");
    }
    service.still_works().await;
}

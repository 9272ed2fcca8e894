//! Metadata and health checks of the server and its model, and their access rules.

use axum::http::StatusCode;
use lookdown::api::Access;
use serde_json::json;

use super::{FRAMES, assert_refused, fast, in_json};
use crate::service::{Bounds, Service};

#[tokio::test]
async fn the_server_and_its_model_describe_themselves() {
    let service = Service::start();
    let server = service.get("/v2").await.json();
    assert_eq!(service.get("/v2/").await.json(), server);
    assert_eq!(server["name"], "lookdown");
    assert_eq!(server["extensions"], json!(["binary_tensor_data"]));
    assert_eq!(server["follow"], false);
    assert_eq!(
        service.get("/v2/health/live").await.json(),
        json!({ "live": true })
    );
    assert_eq!(
        service.get("/v2/health/ready").await.json(),
        json!({ "ready": true })
    );

    let frames = service.get("/v2/models/lookdown").await.json();
    let image = json!([{ "name": "image", "datatype": "BYTES", "shape": [-1] }]);
    assert_eq!(
        (&frames["inputs"], &frames["versions"]),
        (&image, &json!(["1"]))
    );
    let outputs = frames["outputs"].as_array().unwrap().iter();
    let outputs: Vec<_> = outputs
        .map(|output| output["name"].as_str().unwrap())
        .collect();
    assert_eq!(
        outputs,
        [
            "boxes",
            "scores",
            "oriented_boxes",
            "views",
            "counts",
            "report"
        ]
    );

    let ready = service.get("/v2/models/lookdown/ready").await;
    assert_eq!(
        (ready.status, &ready.json()["ready"]),
        (StatusCode::OK, &json!(true))
    );
    for path in ["eager", "eager/ready"] {
        let answer = service.get(&format!("/v2/models/{path}")).await;
        assert_refused(&answer, 404, "unknown-model", "use lookdown");
    }
}

#[tokio::test]
async fn a_stopping_server_and_its_model_are_not_ready() {
    let service = Service::start();
    service.readiness.stopping();
    for path in ["/v2/health/ready", "/v2/models/lookdown/ready"] {
        let answer = service.get(path).await;
        assert_refused(&answer, 503, "shutting-down", "shutting down");
        assert_eq!(answer.header("retry-after"), "1");
    }
    assert_eq!(service.get("/v2/health/live").await.status, 200);
}

#[tokio::test]
async fn without_keys_every_client_may_use_the_model() {
    let service = Service::within(&Bounds {
        access: Access::Open {
            own_machine_only: false,
        },
        ..Bounds::default()
    });
    assert_eq!(service.get("/v2/models/lookdown").await.status, 200);
    assert_eq!(
        service
            .post(FRAMES, &in_json(&fast()).to_string())
            .await
            .status,
        200
    );
}

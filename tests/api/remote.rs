//! Responses to clients about the inference server.

use std::time::Duration;

use lookdown_detect::inference::InferenceError;

use crate::service::{Service, frame};

const FAST: &str = "calibration=lobby&profile=fast";

#[tokio::test]
async fn an_overloaded_inference_server_is_reported_as_overload() {
    let service = Service::start();
    let retry_after = Duration::from_secs(6);
    service
        .gate
        .fail_once(InferenceError::RemoteBusy { retry_after });
    let answer = service.post_raw(FAST, frame()).await;
    assert_eq!(answer.status, 429);
    assert_eq!(answer.header("retry-after"), "7");
    let problem = answer.problem();
    assert_eq!(problem["type"], "/problems/overloaded");
    assert!(
        problem["detail"]
            .as_str()
            .unwrap()
            .contains("inference server")
    );
    service.still_works().await;
}

#[tokio::test]
async fn an_unreachable_inference_server_is_503_without_its_address() {
    let service = Service::start();
    let away = InferenceError::Remote {
        url: "http://10.1.2.3:8000/".to_owned(),
        detail: "the secret cause".to_owned(),
    };
    service.gate.fail_once(away);
    let answer = service.post_raw(FAST, frame()).await;
    assert_eq!(answer.status, 503, "{}", answer.text());
    assert_eq!(answer.header("retry-after"), "1");
    let problem = answer.problem();
    assert_eq!(problem["type"], "/problems/inference-unavailable");
    let text = answer.text();
    assert!(
        !text.contains("10.1.2.3") && !text.contains("secret"),
        "{text}"
    );
    service.still_works().await;
}

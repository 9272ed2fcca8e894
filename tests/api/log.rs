//! Log lines of a request have its request ID, on every thread.

use std::{
    io::{self, Write},
    sync::{Mutex, OnceLock},
};

use axum::{body::Body, http::Request};
use lookdown::{
    settings::{LogFormat, LogSettings},
    telemetry::log_subscriber,
};
use serde_json::Value;

use crate::service::{FRAME_SIDE, Service, frame};

const TRACE: &str = "4bf92f3577b34da6a3ce929d0e0e4736";

/// The log of all tests of this process.
#[derive(Clone, Copy)]
pub(crate) struct Log(&'static Mutex<Vec<u8>>);

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Log {
    pub(crate) fn start() -> Self {
        static LOG: OnceLock<Log> = OnceLock::new();
        *LOG.get_or_init(|| {
            let log = Self(Box::leak(Box::default()));
            let settings = LogSettings {
                format: LogFormat::Json,
                filter: "info,lookdown::access=debug".to_owned(),
            };
            let subscriber = log_subscriber(&settings, move || log, false);
            tracing::subscriber::set_global_default(subscriber).unwrap();
            let usual = std::panic::take_hook();
            std::panic::set_hook(Box::new(move |panic| {
                tracing::error!("{panic}");
                usual(panic);
            }));
            log
        })
    }

    /// Returns everything that was logged so far.
    pub(crate) fn text(self) -> String {
        String::from_utf8(self.0.lock().unwrap().clone()).unwrap()
    }

    /// Returns the lines of a request; those of others must be JSON, too.
    fn for_request(self, request_id: &str) -> Vec<Value> {
        let text = self.text();
        let lines = text.lines().map(|line| serde_json::from_str(line).unwrap());
        lines
            .filter(|line: &Value| line["span"]["request_id"] == request_id)
            .collect()
    }
}

fn request(method: &str, path: &str, id: &str, body: Vec<u8>) -> Request<Body> {
    Request::builder()
        .method(method)
        .uri(path)
        .header("x-request-id", id)
        .header("traceparent", format!("00-{TRACE}-00f067aa0ba902b7-00"))
        .body(body.into())
        .unwrap()
}

fn levels(lines: &[Value]) -> Vec<&str> {
    lines
        .iter()
        .map(|line| line["level"].as_str().unwrap())
        .collect()
}

#[tokio::test]
async fn a_panic_on_another_thread_is_logged_with_the_request_id() {
    let log = Log::start();
    let service = Service::start();
    service.gate.panic_once();
    let path = "/detect?calibration=lobby&profile=fast";
    let answer = service.send(request("POST", path, "panics", frame())).await;
    assert_eq!(answer.status, 500);
    let lines = log.for_request("panics");
    assert_eq!(levels(&lines), ["ERROR", "ERROR", "INFO"], "{lines:#?}");
    for line in &lines {
        assert_eq!(line["span"]["trace_id"], TRACE, "{line}");
        assert_eq!(line["span"]["route"], "/detect", "{line}");
    }
    let panic = lines[0]["message"].as_str().unwrap();
    assert!(panic.contains("the secret cause"), "{panic}");
    assert_eq!(lines[2]["target"], "lookdown::access");
    assert_eq!(lines[2]["status"], 500);
    assert_eq!(lines[2]["reason"], "internal");
    assert!(lines[2]["seconds"].as_f64().unwrap() > 0.0);
}

#[tokio::test]
async fn an_invalid_image_is_no_error_in_the_log() {
    let log = Log::start();
    let service = Service::start();
    let path = "/detect?calibration=lobby&profile=fast";
    let body = b"words of the client".to_vec();
    let answer = service.send(request("POST", path, "no-image", body)).await;
    assert_eq!(answer.status, 415);
    let lines = log.for_request("no-image");
    assert_eq!(levels(&lines), ["DEBUG"], "{lines:#?}");
    assert!(!log.text().contains("words of the client"));
}

#[tokio::test]
async fn log_lines_of_a_calibration_change_have_the_request_id() {
    let log = Log::start();
    let service = Service::start();
    let calibration = format!(
        r#"{{"id": "yard", "image": {{"width": {FRAME_SIDE}, "height": {FRAME_SIDE}}},
        "lens": {{"model": "equidistant", "focal": 63.66, "cx": 99.5, "cy": 99.5}},
        "mount": {{"world_up": [0, 0, -1]}}}}"#
    );
    let put = request("PUT", "/calibrations/yard", "puts", calibration.into());
    let answer = service.send(put).await;
    assert_eq!(answer.status, 201, "{}", answer.text());
    let lines = log.for_request("puts");
    assert_eq!(levels(&lines), ["INFO", "DEBUG"], "{lines:#?}");
    assert_eq!(lines[0]["calibration"], "yard");
    assert_eq!(lines[1]["message"], "answered");
}

#[tokio::test]
async fn a_request_of_no_trace_has_no_trace_id() {
    let log = Log::start();
    let service = Service::start();
    let request = Request::get("/livez").header("x-request-id", "no-trace");
    service.send(request.body(Body::empty()).unwrap()).await;
    let lines = log.for_request("no-trace");
    assert_eq!(levels(&lines), ["DEBUG"], "{lines:#?}");
    assert_eq!(lines[0]["span"].get("trace_id"), None);
    assert_eq!(lines[0]["status"], 200);
    assert_eq!(lines[0].get("reason"), None);
}

#[tokio::test]
async fn each_occurrence_has_its_own_instance_that_is_logged() {
    let log = Log::start();
    let service = Service::start();
    let mut instances = Vec::new();
    for _ in 0..2 {
        let request = Request::get("/nothing").header("x-request-id", "the-same");
        let answer = service.send(request.body(Body::empty()).unwrap()).await;
        let problem = answer.problem();
        assert_eq!(problem["request_id"], "the-same");
        let instance = problem["instance"].as_str().unwrap();
        instances.push(instance.strip_prefix("urn:uuid:").unwrap().to_owned());
    }
    assert_ne!(instances[0], instances[1]);
    let lines = log.for_request("the-same");
    let logged: Vec<_> = lines.iter().map(|line| &line["instance"]).collect();
    let expected: Vec<_> = instances.into_iter().map(Value::from).collect();
    assert_eq!(logged, expected.iter().collect::<Vec<_>>());
}

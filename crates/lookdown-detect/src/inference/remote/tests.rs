//! Tests against a fake server with scripted responses on a real socket.

mod fake;
mod hostile;

use std::{fs, path::Path, time::Duration};

use tempfile::TempDir;

use self::fake::{FakeServer, ScriptedReply};
use super::*;
use lookdown_imaging::ViewBatch;

/// A folder with a manifest and no weights.
fn manifest() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let text = "name = \"here\"\nonnx = \"model.onnx\"\n";
    fs::write(folder.path().join("model.toml"), text).unwrap();
    folder
}

/// Long enough for a loaded machine.
const PATIENCE: Duration = Duration::from_secs(20);

fn server(fake: &FakeServer) -> Arc<RemoteServer> {
    server_with(fake, None, PATIENCE)
}

fn server_with(fake: &FakeServer, token: Option<&str>, timeout: Duration) -> Arc<RemoteServer> {
    let options = RemoteOptions {
        url: fake.address().parse().unwrap(),
        token: token.map(|token| token.parse().unwrap()),
        model: "there".to_owned(),
        called: "here".to_owned(),
        timeout,
    };
    Arc::new(RemoteServer::new(options, Arc::default()).unwrap())
}

fn load(server: &Arc<RemoteServer>, model: &Path) -> Result<RemoteDetector, InferenceError> {
    let options = CandidateOptions {
        score_floor: 0.1,
        max_detections_per_view: 10,
    };
    RemoteDetector::load_sessions(server, model, options, NonZeroUsize::MIN).map(|(first, _)| first)
}

fn detect(detector: &mut RemoteDetector, views: usize) -> Result<HeadOutput, InferenceError> {
    let mut batch = ViewBatch::default();
    for slot in batch.prepare(views, &detector.input().clone()) {
        slot.fill(7.0);
    }
    detector.detect(&batch)
}

#[test]
fn views_are_sent_as_bytes_or_as_lists_as_the_server_supports() {
    for (as_bytes, first_axis) in [(true, -1), (false, -1), (true, 2)] {
        let fake = FakeServer::start(as_bytes, first_axis);
        let folder = manifest();
        let mut detector = load(&server(&fake), folder.path()).unwrap();
        assert_eq!((detector.name(), detector.input().width), ("here", 32));
        assert_eq!(
            detector.views_per_run().is_some(),
            first_axis == 2,
            "the metadata gives the number"
        );
        let found = detect(&mut detector, 3).unwrap();
        let scores: Vec<_> = found.per_view.iter().map(|view| view[0].score).collect();
        assert_eq!(scores, [0.5; 3], "{as_bytes}");
        assert_eq!(found.per_view[2][0].bbox.corners(), [1.0, 2.0, 3.0, 4.0]);
        let lengths: Vec<_> = fake
            .inferred()
            .iter()
            .map(|request| request.head_length.is_some())
            .collect();
        let requests = if first_axis == 2 { 2 } else { 1 };
        assert_eq!(lengths, vec![as_bytes; requests]);
        assert_eq!(fake.inferred()[0].path, "/v2/models/there/infer");
    }
}

#[test]
fn every_request_carries_the_token_if_one_is_set() {
    for token in [None, Some("s3cret")] {
        let fake = FakeServer::start(true, -1);
        let folder = manifest();
        let server = server_with(&fake, token, PATIENCE);
        detect(&mut load(&server, folder.path()).unwrap(), 1).unwrap();
        let shown = fake.authorizations();
        // The server's metadata, the model's metadata and a view.
        assert!(shown.len() >= 3, "{shown:?}");
        let expected = token.map(|_| "bearer s3cret");
        assert!(
            shown.iter().all(|shown| shown.as_deref() == expected),
            "{shown:?}"
        );
    }
}

#[test]
fn a_rejected_token_fails_at_the_start() {
    let fake = FakeServer::start(true, -1);
    fake.refuse_all(401);
    let folder = manifest();
    let error = load(&server(&fake), folder.path()).err().unwrap();
    assert!(
        matches!(error, InferenceError::RemoteDenied { .. }),
        "{error}"
    );
    let message = error.to_string();
    assert!(
        message.contains("use the token") && message.contains("401"),
        "{message}"
    );
}

#[test]
fn an_overloaded_server_is_busy_and_an_unready_one_unavailable() {
    let fake = FakeServer::start(true, -1);
    let folder = manifest();
    let server = server(&fake);
    let mut detector = load(&server, folder.path()).unwrap();
    fake.queue(ScriptedReply::status(429).header("Retry-After", "7"));
    let error = detect(&mut detector, 1).unwrap_err();
    assert!(
        matches!(error, InferenceError::RemoteBusy { retry_after } if retry_after.as_secs() == 7),
        "{error}"
    );
    fake.queue(ScriptedReply::status(503));
    let error = detect(&mut detector, 1).unwrap_err();
    assert!(
        matches!(error, InferenceError::RemoteBusy { .. }),
        "{error}"
    );
    fake.be_ready(false);
    fake.queue(ScriptedReply::status(503));
    let error = detect(&mut detector, 1).unwrap_err();
    assert!(matches!(error, InferenceError::Remote { .. }), "{error}");
    let counts = ["busy", "failed", "answered"].map(|result| server.count_of(result));
    assert_eq!(counts, [2, 1, 0]);
}

#[test]
fn a_huge_retry_after_is_shortened_to_a_minute() {
    let fake = FakeServer::start(true, -1);
    let folder = manifest();
    let mut detector = load(&server(&fake), folder.path()).unwrap();
    let seconds = u64::MAX.to_string();
    fake.queue(ScriptedReply::status(429).header("Retry-After", &seconds));
    let error = detect(&mut detector, 1).unwrap_err();
    assert!(
        matches!(error, InferenceError::RemoteBusy { retry_after } if retry_after.as_secs() == 60),
        "{error}"
    );
}

#[test]
fn a_failing_server_gets_no_requests_until_it_is_ready() {
    let fake = FakeServer::start(true, -1);
    let folder = manifest();
    let server = server(&fake);
    let mut detector = load(&server, folder.path()).unwrap();
    for _ in 0..3 {
        fake.queue(ScriptedReply::status(500));
        assert!(server.is_available());
        let message = detect(&mut detector, 1).unwrap_err().to_string();
        assert!(message.contains("answered 500"), "{message}");
    }
    assert!(!server.is_available());
    detect(&mut detector, 1).unwrap_err();
    assert_eq!((fake.inferred().len(), server.count_of("not_sent")), (3, 1));
    fake.be_ready(false);
    assert!(!server.check_health());
    fake.be_ready(true);
    assert!(server.check_health());
    detect(&mut detector, 1).unwrap();
}

#[test]
fn an_idle_server_is_probed_and_an_answering_one_is_not() {
    let fake = FakeServer::start(true, -1);
    let folder = manifest();
    let server = server(&fake);
    let mut detector = load(&server, folder.path()).unwrap();
    fake.be_ready(false);
    assert!(server.check_health() && server.check_health() && !server.check_health());
    fake.be_ready(true);
    assert!(server.check_health());
    detect(&mut detector, 1).unwrap();
    fake.be_ready(false);
    assert!(
        (0..5).all(|_| server.check_health()),
        "it has just responded"
    );
}

#[test]
fn a_request_on_a_closed_connection_is_retried() {
    let fake = FakeServer::start(true, -1);
    let folder = manifest();
    let mut detector = load(&server(&fake), folder.path()).unwrap();
    for _ in 0..3 {
        fake.queue(ScriptedReply::closed());
        detect(&mut detector, 1).unwrap();
    }
}

#[test]
fn a_slow_response_times_out() {
    let fake = FakeServer::start(true, -1);
    let folder = manifest();
    let server = server_with(&fake, None, Duration::from_secs(2));
    let mut detector = load(&server, folder.path()).unwrap();
    fake.queue(ScriptedReply::slow());
    let error = detect(&mut detector, 1).unwrap_err();
    assert!(error.to_string().contains("timed out"), "{error}");
}

#[test]
fn invalid_responses_are_reported() {
    let fake = FakeServer::start(true, -1);
    let folder = manifest();
    for (reply, part) in [
        (
            ScriptedReply::status(404).body("{\"error\":\"no model\"}"),
            "no model",
        ),
        (ScriptedReply::status(200).body("{}"), "cannot be read"),
        (
            ScriptedReply::status(302).header("Location", "http://127.0.0.1:9/"),
            "answered 302",
        ),
    ] {
        let server = server(&fake);
        let mut detector = load(&server, folder.path()).unwrap();
        fake.queue(reply);
        let error = detect(&mut detector, 1).unwrap_err();
        assert!(matches!(error, InferenceError::Remote { .. }), "{error}");
        assert!(error.to_string().contains(part), "{error}");
    }
    let server = server(&fake);
    let mut detector = load(&server, folder.path()).unwrap();
    fake.queue(ScriptedReply::status(200).body("{\"outputs\":[]}"));
    let error = detect(&mut detector, 1).unwrap_err();
    assert!(error.to_string().contains("no output \"boxes\""), "{error}");
}

#[test]
fn a_model_that_cannot_be_used_is_refused_with_the_reason() {
    let folder = manifest();
    for (first_axis, part) in [(0, "32-bit floats"), (257, "at most 256")] {
        let fake = FakeServer::start(true, first_axis);
        let error = load(&server(&fake), folder.path()).err().unwrap();
        assert!(
            matches!(error, InferenceError::RemoteModel { .. }),
            "{error}"
        );
        assert!(error.to_string().contains(part), "{error}");
    }
    let fake = FakeServer::start(true, -1);
    let server = server(&fake);
    fake.end();
    let error = load(&server, folder.path()).err().unwrap();
    assert!(matches!(error, InferenceError::Remote { .. }), "{error}");
}

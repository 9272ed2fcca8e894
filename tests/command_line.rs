//! The executable: what it prints where, and how it ends.
#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::{
    io::{BufRead, BufReader},
    net::TcpListener,
    process::{Command, Output, Stdio},
};

fn lookdown(arguments: &[&str], environment: &[(&str, &str)]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookdown"));
    command
        .args(arguments)
        .envs(environment.iter().copied())
        .output()
        .unwrap()
}

/// A failure must say one line on standard error, nothing on standard output, and end with 1.
#[track_caller]
fn assert_fails_with(output: &Output, parts: &[&str]) {
    let message = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(output.stdout.is_empty());
    assert_eq!(message.lines().count(), 1, "{message}");
    for part in parts {
        assert!(message.contains(part), "{message:?} does not say {part:?}");
    }
}

#[test]
fn the_api_description_goes_to_standard_output() {
    let output = lookdown(&["openapi"], &[]);
    assert!(output.status.success());
    let document: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(document["info"]["title"], "Lookdown");
}

#[test]
fn a_settings_file_that_cannot_be_read_ends_the_start_with_a_sentence() {
    let output = lookdown(&["serve", "--config", "/nowhere/lookdown.toml"], &[]);
    assert_fails_with(&output, &["/nowhere/lookdown.toml", "--config"]);
}

#[test]
fn a_port_in_use_ends_the_start_with_a_sentence() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let output = lookdown(&["serve"], &[("LOOKDOWN__SERVER__LISTEN", &address)]);
    assert_fails_with(&output, &["server.listen", &address, "in use"]);
}

#[test]
fn a_missing_library_ends_the_start_with_a_sentence() {
    let output = lookdown(
        &["serve"],
        &[
            ("LOOKDOWN__SERVER__LISTEN", "127.0.0.1:0"),
            (
                "LOOKDOWN__INFERENCE__LIBRARY_PATH",
                "/nowhere/libonnxruntime.so",
            ),
        ],
    );
    let key = "inference.library_path";
    assert_fails_with(&output, &[key, "/nowhere/libonnxruntime.so", "make setup"]);
}

#[test]
fn a_parameter_out_of_range_is_refused_as_over_http() {
    let output = lookdown(&["detect", "frame.jpg", "--score-threshold", "-1"], &[]);
    assert_fails_with(&output, &["score_threshold: -1 is outside 0 to 1"]);
}

#[test]
fn several_pictures_cannot_be_drawn_into_one_file() {
    let output = lookdown(&["detect", "a.jpg", "b.jpg", "--annotate", "out.jpg"], &[]);
    assert_fails_with(&output, &["--annotate", "single"]);
}

#[test]
fn a_calibration_that_is_nowhere_is_refused_before_anything_is_loaded() {
    let output = lookdown(&["detect", "a.jpg", "--calibration", "no/such.json"], &[]);
    assert_fails_with(&output, &["--calibration", "no/such.json"]);
}

#[test]
fn every_usable_picture_gets_a_line_and_every_other_a_sentence() {
    let office = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/office.jpg");
    let calibration = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/samples/calibrations/office.json"
    );
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("notes.txt");
    std::fs::write(&text, "not a picture").unwrap();
    let text = text.to_str().unwrap();

    let images = ["detect", text, office, "/nowhere.jpg"];
    let flags = ["--profile", "fast", "--calibration", calibration];
    let output = lookdown(
        &[&images[..], &flags].concat(),
        &[("LOOKDOWN__LOG__FILTER", "warn")],
    );
    let messages = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{messages}");
    let messages: Vec<_> = messages.lines().collect();
    assert_eq!(messages.len(), 2, "{messages:?}");
    assert!(
        messages[0].starts_with(&format!("lookdown: {text}: ")),
        "{messages:?}"
    );
    assert!(
        messages[1].starts_with("lookdown: /nowhere.jpg: "),
        "{messages:?}"
    );

    let reports = String::from_utf8(output.stdout).unwrap();
    assert_eq!(reports.lines().count(), 1);
    let report: serde_json::Value = serde_json::from_str(&reports).unwrap();
    assert_eq!(report["request_id"], office);
    assert_eq!(report["calibration"]["id"], "office");
    assert!(!report["persons"].as_array().unwrap().is_empty());
}

#[test]
fn a_person_is_drawn_into_the_picture_on_request() {
    let office = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/office.jpg");
    let folder = tempfile::tempdir().unwrap();
    let drawn = folder.path().join("drawn.jpg");
    let flags = ["--profile", "fast", "--annotate", drawn.to_str().unwrap()];
    let output = lookdown(&[&["detect", office], &flags[..]].concat(), &[]);
    assert!(output.status.success(), "{output:?}");
    let jpeg = std::fs::read(drawn).unwrap();
    assert!(jpeg.starts_with(&[0xff, 0xd8, 0xff]));
}

#[test]
fn a_termination_signal_ends_the_server_in_order() {
    let mut server = Command::new(env!("CARGO_BIN_EXE_lookdown"))
        .arg("serve")
        .env("LOOKDOWN__SERVER__LISTEN", "127.0.0.1:0")
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut log = BufReader::new(server.stderr.take().unwrap()).lines();
    let mut log_says = |part: &str| log.any(|line| line.unwrap().contains(part));
    assert!(log_says("listening on http://127.0.0.1:"));
    assert!(log_says("ready: try curl"));
    let terminate = format!("kill -TERM {}", server.id());
    let sent = Command::new("sh").args(["-c", &terminate]).status();
    assert!(sent.unwrap().success());
    assert!(log_says("told to stop"));
    assert!(log_says("stopped"));
    assert!(server.wait().unwrap().success());
}

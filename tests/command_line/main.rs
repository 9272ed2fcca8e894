//! The executable: its outputs and exit codes.
#![expect(clippy::unwrap_used, reason = "a panic fails the test")]

mod calibration;
mod camera_height;
mod evaluate;
mod evaluation;
mod examples;
mod fit_output;
mod health;
mod keys;
mod models;
mod planted;
mod readme;
mod run;
mod samples;
mod serve;
mod shell;
mod systemd;
mod telemetry;

use std::{
    io::{BufRead, BufReader},
    net::TcpStream,
    process::{Command, Output, Stdio},
};

/// The variable of a network that loads at once, for servers that are asked for no detections.
pub(crate) const SMALL_MODEL: (&str, &str) = (
    "LOOKDOWN__MODEL__PATH",
    concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/fixtures/models/any_batch.onnx"
    ),
);

pub(crate) fn lookdown(arguments: &[&str], environment: &[(&str, &str)]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookdown"));
    command
        .args(arguments)
        .envs(environment.iter().copied())
        .output()
        .unwrap()
}

/// Asserts a failure: one line on standard error, nothing on standard output, exit code 1.
#[track_caller]
pub(crate) fn assert_fails_with(output: &Output, parts: &[&str]) {
    let message = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(output.stdout.is_empty());
    assert_eq!(message.lines().count(), 1, "{message}");
    for part in parts {
        assert!(message.contains(part), "{message:?} does not say {part:?}");
    }
}

/// Asserts that the command line refuses a value and lists the possible ones.
fn assert_lists_values(output: &Output, value: &str, possible: &str) {
    let message = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(2), "{message}");
    let expected = format!("[possible values: {possible}");
    assert!(
        message.contains(value) && message.contains(&expected),
        "{message}"
    );
}

#[test]
fn unknown_choices_are_refused_with_the_possible_values() {
    for (arguments, possible) in [
        (
            ["detect", "a.jpg", "--profile", "best"],
            "paper, fast, balanced",
        ),
        (
            ["detect", "a.jpg", "--refine", "best"],
            "nms, soft_nms_linear",
        ),
        (
            ["eval", "folder", "--refine", "best"],
            "nms, soft_nms_linear",
        ),
        (
            ["eval", "folder", "--by", "best"],
            "distance, size, visibility",
        ),
        (
            ["key", "new", "--scope", "best"],
            "detect, read, view, admin",
        ),
    ] {
        assert_lists_values(&lookdown(&arguments, &[]), "best", possible);
    }
}

#[test]
fn a_closed_pipe_is_no_error() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_lookdown"))
        .arg("openapi")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The document is larger than the buffer of a pipe.
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    assert!(output.stderr.is_empty(), "{output:?}");
}

#[test]
fn reports_may_be_read_up_to_a_line() {
    let office = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/office.jpg");
    let mut child = Command::new(env!("CARGO_BIN_EXE_lookdown"))
        .args(["detect", "--profile", "fast", office, office, office])
        .env("LOOKDOWN__LOG__FILTER", "warn")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // As `head -1` does.
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap())
        .read_line(&mut line)
        .unwrap();
    let report: serde_json::Value = serde_json::from_str(&line).unwrap();
    assert_eq!(report["request_id"], office);
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    assert!(output.stderr.is_empty(), "{output:?}");
}

#[test]
fn serve_listens_at_the_address_of_the_flag() {
    let mut server = Command::new(env!("CARGO_BIN_EXE_lookdown"))
        .args(["serve", "--listen", "127.0.0.1:0"])
        .env("LOOKDOWN__SERVER__LISTEN", "127.0.0.1:1")
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let log = BufReader::new(server.stderr.take().unwrap());
    let mut addresses = log.lines().map_while(Result::ok).filter_map(|line| {
        let (_, rest) = line.split_once("listening on http://")?;
        Some(rest.split_once(',')?.0.to_owned())
    });
    let address = addresses.next();
    let connection = address.as_ref().map(TcpStream::connect);
    server.kill().unwrap();
    server.wait().unwrap();
    assert!(
        connection.is_some_and(|result| result.is_ok()),
        "{address:?}"
    );
    assert_ne!(address.unwrap(), "127.0.0.1:1");
}

#[test]
fn flags_override_settings_of_the_environment() {
    let environment = [("LOOKDOWN__SERVER__LISTEN", "127.0.0.1:1")];
    let refused = |flags: &[&str], parts: &[&str]| {
        let arguments = [&["serve", "--check"], flags].concat();
        assert_fails_with(&lookdown(&arguments, &environment), parts);
    };
    refused(
        &["--listen", "nowhere"],
        &["server.listen", "nowhere", "127.0.0.1:8080"],
    );
    refused(
        &["--set", "limits.max_image_side=0"],
        &["limits.max_image_side"],
    );
    refused(
        &["--set", "server.listn=127.0.0.1:0"],
        &["--set server.listn", "`listen`"],
    );
}

#[test]
fn the_api_description_goes_to_standard_output() {
    let output = lookdown(&["openapi"], &[]);
    assert!(output.status.success());
    let document: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(document["info"]["title"], "Lookdown");
}

#[test]
fn a_parameter_out_of_range_is_refused_as_over_http() {
    let output = lookdown(&["detect", "frame.jpg", "--score-threshold", "-1"], &[]);
    assert_fails_with(
        &output,
        &["score_threshold: \"-1\" is not a number from 0 to 1"],
    );
}

#[test]
fn several_images_cannot_be_drawn_into_one_file() {
    let output = lookdown(&["detect", "a.jpg", "b.jpg", "--annotate", "out.jpg"], &[]);
    assert_fails_with(&output, &["--annotate", "single"]);
}

#[test]
fn a_missing_calibration_is_refused_before_loading() {
    let output = lookdown(&["detect", "a.jpg", "--calibration", "no/such.json"], &[]);
    assert_fails_with(&output, &["--calibration", "no/such.json"]);
}

#[test]
fn a_recording_in_the_last_year_is_refused() {
    let walks = "tests/real/walks/walks.mp4";
    let calibration = "tests/real/walks/calibration.json";
    let start = ["--start", "9999-12-30T21:59:59Z"];
    let arguments = ["count", walks, "--calibration", calibration];
    let output = lookdown(&[&arguments[..], &start].concat(), &[]);
    assert_fails_with(&output, &[walks, "begins at 9999-12-30", "--start"]);
}

#[test]
fn every_image_gives_a_report_or_an_error_line() {
    let office = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/office.jpg");
    let calibration = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/samples/calibrations/office.json"
    );
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("notes.txt");
    std::fs::write(&text, "not an image").unwrap();
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
fn annotate_draws_persons_into_the_image() {
    let office = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/office.jpg");
    let folder = tempfile::tempdir().unwrap();
    let drawn = folder.path().join("drawn.jpg");
    let flags = ["--profile", "fast", "--annotate", drawn.to_str().unwrap()];
    let output = lookdown(&[&["detect", office], &flags[..]].concat(), &[]);
    assert!(output.status.success(), "{output:?}");
    let jpeg = std::fs::read(drawn).unwrap();
    assert!(jpeg.starts_with(&[0xff, 0xd8, 0xff]));

    let drawn = folder.path().join("drawn.png");
    let flags = ["--profile", "fast", "--annotate", drawn.to_str().unwrap()];
    let options = ["--draw", "boxes,views,timestamp", "--width", "300"];
    let output = lookdown(&[&["detect", office], &flags[..], &options].concat(), &[]);
    assert!(output.status.success(), "{output:?}");
    let png = std::fs::read(drawn).unwrap();
    assert!(png.starts_with(b"\x89PNG"));
    // The width is the first number of the header (PNG specification, section 11.2.1).
    assert_eq!(png[16..20], 300_u32.to_be_bytes());
}

#[test]
fn annotation_options_are_validated_and_need_annotate() {
    let annotate = ["detect", "a.jpg", "--annotate", "out.jpg"];
    let output = lookdown(&[&annotate[..], &["--draw", "hats"]].concat(), &[]);
    assert_lists_values(&output, "hats", "blur, silhouette, boxes");
    let output = lookdown(&[&annotate[..], &["--quality", "101"]].concat(), &[]);
    assert_fails_with(
        &output,
        &["quality: \"101\" is not a whole number from 1 to 100"],
    );
    let output = lookdown(&["detect", "a.jpg", "--width", "300"], &[]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && message.contains("--annotate"));
}

#[test]
fn a_folder_of_images_is_converted_to_annotations() {
    let samples = concat!(env!("CARGO_MANIFEST_DIR"), "/samples");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("labels");
    let flags = ["--profile", "fast", "--format", "coco", "--out"];
    let arguments = [&["detect", samples], &flags[..], &[out.to_str().unwrap()]].concat();
    let output = lookdown(&arguments, &[]);
    let messages = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{messages}");
    assert!(output.stdout.is_empty());
    assert!(messages.contains("fast: 3 of 3 images"), "{messages}");
    let text = std::fs::read_to_string(out.join("annotations.json")).unwrap();
    let annotations: serde_json::Value = serde_json::from_str(&text).unwrap();
    let images = annotations["images"].as_array().unwrap();
    let names: Vec<_> = images
        .iter()
        .map(|image| image["file_name"].as_str())
        .collect();
    assert_eq!(names, ["canteen.jpg", "lounge.jpg", "office.jpg"].map(Some));
    assert!(!annotations["annotations"].as_array().unwrap().is_empty());
}

#[test]
fn images_with_the_same_annotation_file_are_refused() {
    let flags = ["--format", "voc", "--out", "/nowhere/labels"];
    let arguments = [&["detect", "a/1.jpg", "b/1.png"], &flags[..]].concat();
    let output = lookdown(&arguments, &[]);
    assert_fails_with(&output, &["--format voc", "a/1.jpg", "b/1.png"]);
}

#[test]
fn oriented_boxes_are_refused_for_formats_without_them() {
    let flags = ["--format", "voc", "--out", "labels", "--oriented"];
    let output = lookdown(&[&["detect", "a.jpg"], &flags[..]].concat(), &[]);
    assert_fails_with(&output, &["--oriented", "voc", "yolo", "cvat"]);
}

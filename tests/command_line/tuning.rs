//! `lookdown model tune` on the shipped samples.

use std::{fs, path::Path, process::Output};

use tempfile::{TempDir, tempdir};

use crate::{assert_fails_with, lookdown};

/// A copy of a model's folder.
fn copied(model: &str) -> TempDir {
    let (root, folder) = (Path::new(env!("CARGO_MANIFEST_DIR")), tempdir().unwrap());
    for file in ["model.onnx", "model.toml"] {
        fs::copy(root.join(model).join(file), folder.path().join(file)).unwrap();
    }
    folder
}

fn tune(folder: &TempDir, profile: &str, flags: &[&str]) -> Output {
    let samples = concat!(env!("CARGO_MANIFEST_DIR"), "/samples");
    let model = folder.path().to_str().unwrap();
    let arguments = ["model", "tune", model, samples, "--profile", profile];
    lookdown(&[&arguments, flags].concat(), &[])
}

fn manifest(folder: &TempDir) -> String {
    fs::read_to_string(folder.path().join("model.toml")).unwrap()
}

#[test]
fn a_tuned_model_keeps_its_manifest_and_detects_with_the_tuning() {
    let folder = copied("models/nanodet_g_views_416_int8");
    let before = manifest(&folder);
    let output = tune(&folder, "fast", &[]);
    assert!(output.status.success(), "{output:?}");
    let after = manifest(&folder);
    let tuning = after.strip_prefix(&before).unwrap();
    assert!(tuning.contains("[tuning.fast]\neven_odds = 0."), "{after}");
    let printed = String::from_utf8(output.stdout).unwrap();
    let measured = |line: &&str| line.contains("AP50");
    // The profile's own values, three fills, three other votes, and the calibrated scores.
    assert_eq!(printed.lines().filter(measured).count(), 8, "{printed}");
    let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/office.jpg");
    let score = || {
        let environment = [("LOOKDOWN__MODEL__PATH", folder.path().to_str().unwrap())];
        let output = lookdown(&["detect", sample, "--profile", "fast"], &environment);
        assert!(output.status.success(), "{output:?}");
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        report["persons"][0]["score"].as_f64().unwrap()
    };
    let tuned = score();
    fs::write(folder.path().join("model.toml"), &before).unwrap();
    assert_ne!(tuned, score());
}

#[test]
fn a_network_that_finds_nobody_is_not_tuned() {
    let folder = copied("tests/fixtures/models/families/yolox");
    let before = manifest(&folder);
    let output = tune(&folder, "fast", &[]);
    assert_eq!(output.status.code(), Some(1));
    let refusal = String::from_utf8(output.stderr).unwrap();
    let reason = "fast: the scores cannot be calibrated";
    assert!(refusal.contains(reason), "{refusal}");
    assert_eq!(manifest(&folder), before);
}

#[test]
fn a_dry_run_changes_no_manifest_and_a_missing_one_is_named() {
    let folder = copied("models/nanodet_g_views_416_int8");
    let before = manifest(&folder);
    assert!(tune(&folder, "direct", &["--dry-run"]).status.success());
    assert_eq!(manifest(&folder), before);
    fs::remove_file(folder.path().join("model.toml")).unwrap();
    assert_fails_with(
        &tune(&folder, "fast", &[]),
        &["model.toml", "--write-manifest"],
    );
}

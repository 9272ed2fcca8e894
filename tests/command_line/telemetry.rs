//! The telemetry of ONNX Runtime: its vendor's builds record it in the home folder and send it.

use std::{fs, process::Command};

#[test]
fn onnx_runtime_records_no_telemetry() {
    let home = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_lookdown"))
        .args(["detect", "samples/office.jpg", "--profile", "direct"])
        // ONNX Runtime has no telemetry in continuous integration.
        .env_remove("CI")
        .env_remove("ORT_DISABLE_TELEMETRY")
        .env_remove("XDG_CACHE_HOME")
        .env("HOME", home.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    assert_eq!(fs::read_dir(home.path()).unwrap().count(), 0);
}

//! `lookdown calibration height`

use std::{fs, path::Path};

use serde_json::{Value, json};

use crate::{assert_fails_with, lookdown};

/// Copies the calibration of a sample without its height.
fn without_height(folder: &Path) -> String {
    let text = fs::read_to_string("samples/calibrations/office.json").unwrap();
    let mut calibration: Value = serde_json::from_str(&text).unwrap();
    calibration["mount"]
        .as_object_mut()
        .unwrap()
        .remove("height_m");
    let file = folder.join("office.json");
    fs::write(&file, calibration.to_string()).unwrap();
    file.to_str().unwrap().to_owned()
}

#[test]
fn height_of_a_camera_is_found_from_people() {
    let folder = tempfile::tempdir().unwrap();
    let file = without_height(folder.path());
    let found = lookdown(&["calibration", "height", &file, "samples/office.jpg"], &[]);
    let said = String::from_utf8_lossy(&found.stderr);
    assert!(found.status.success(), "{said}");
    assert!(said.contains("people"), "{said}");
    let calibration: Value = serde_json::from_slice(&found.stdout).unwrap();
    let source = &calibration["sources"]["height_m"];
    assert_eq!(source["source"], "from_people");
    // The true height is 2.9 m.
    let error = calibration["mount"]["height_m"].as_f64().unwrap() - 2.9;
    assert!(
        error.abs() < 3.0 * source["uncertainty"].as_f64().unwrap(),
        "{said}"
    );
}

#[test]
fn a_given_height_is_not_replaced_by_that_from_people() {
    let output = lookdown(
        &[
            "calibration",
            "height",
            "samples/calibrations/office.json",
            "samples/office.jpg",
        ],
        &[],
    );
    assert_fails_with(&output, &["mount.height_m is 2.9 m", "remove it"]);
}

/// Writes the reports of the office sample into a file.
fn reports(folder: &Path) -> String {
    let office = [
        "detect",
        "samples/office.jpg",
        "--calibration",
        "samples/calibrations/office.json",
    ];
    let detected = lookdown(&office, &[]);
    assert!(detected.status.success(), "{detected:?}");
    let file = folder.join("office.jsonl");
    fs::write(&file, detected.stdout).unwrap();
    file.to_str().unwrap().to_owned()
}

#[test]
fn height_from_reports_is_that_from_frames() {
    let folder = tempfile::tempdir().unwrap();
    let (file, reports) = (without_height(folder.path()), reports(folder.path()));
    let height = |arguments: &[&str]| {
        let found = lookdown(
            &[&["calibration", "height", &file], arguments].concat(),
            &[],
        );
        assert!(found.status.success(), "{found:?}");
        let calibration: Value = serde_json::from_slice(&found.stdout).unwrap();
        calibration["mount"]["height_m"].as_f64().unwrap()
    };
    let of_frame = height(&["samples/office.jpg"]);
    let of_report = height(&["--reports", &reports]);
    assert!(
        (of_report - of_frame).abs() < 0.015,
        "{of_report}, {of_frame}"
    );
    // A frame of half the size, and persons with a score that counts use only.
    let mut report: Value = serde_json::from_slice(&fs::read(&reports).unwrap()).unwrap();
    for side in ["width", "height"] {
        report["image"][side] = json!(480);
    }
    let persons = report["persons"].as_array_mut().unwrap();
    for person in persons.iter_mut() {
        for name in ["cx", "cy", "width", "height"] {
            let value = person["oriented_box"][name].as_f64().unwrap();
            person["oriented_box"][name] = json!(value / 2.0);
        }
    }
    let mut unlikely = persons[0].clone();
    unlikely["score"] = json!(0.1);
    unlikely["oriented_box"]["height"] = json!(10.0);
    persons.extend(vec![unlikely; 20]);
    fs::write(&reports, format!("{report}\n\n")).unwrap();
    let of_half = height(&["--reports", &reports]);
    assert!((of_half - of_frame).abs() < 0.025, "{of_half}, {of_frame}");
    let of_both = height(&["samples/office.jpg", "--reports", &reports]);
    assert!((of_both - of_frame).abs() < 0.1, "{of_both}, {of_frame}");
}

#[test]
fn reports_of_other_cameras_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (file, reports) = (without_height(folder.path()), reports(folder.path()));
    let report = fs::read_to_string(&reports).unwrap();
    let refuse = |line: &str, parts: &[&str]| {
        fs::write(&reports, format!("{report}{line}\n")).unwrap();
        let refused = lookdown(
            &["calibration", "height", &file, "--reports", &reports],
            &[],
        );
        assert_fails_with(&refused, &[&["office.jsonl, line 2: "][..], parts].concat());
    };
    let changed = |path: &str, value: Value| {
        let mut report: Value = serde_json::from_str(&report).unwrap();
        *report.pointer_mut(path).unwrap() = value;
        report.to_string()
    };
    let other = changed("/calibration/id", json!("hall"));
    refuse(
        &other,
        &[
            "the calibration hall, not office",
            "give reports of this camera",
        ],
    );
    let assumed = changed("/calibration/assumed", json!(true));
    refuse(&assumed, &["without a calibration", "--calibration office"]);
    for width in [1280, 0] {
        let cropped = changed("/image/width", json!(width));
        refuse(
            &cropped,
            &[&format!("{width}×960"), "960×960", "uncropped frames"],
        );
    }
    refuse("{}", &["not a report (missing field", "`lookdown detect`"]);
}

#[test]
fn unreadable_reports_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = without_height(folder.path());
    let height = |arguments: &[&str]| {
        lookdown(
            &[&["calibration", "height", &file], arguments].concat(),
            &[],
        )
    };
    assert_fails_with(
        &height(&["--reports", "none.jsonl"]),
        &["--reports: none.jsonl"],
    );
    let long = folder.path().join("long.jsonl");
    fs::write(&long, vec![b' '; (8 << 20) + 1]).unwrap();
    let refused = height(&["--reports", long.to_str().unwrap()]);
    assert_fails_with(&refused, &["line 1", "8 MiB", "one report per line"]);
    let neither = height(&[]);
    let message = String::from_utf8(neither.stderr).unwrap();
    assert!(
        neither.status.code() == Some(2) && message.contains("FRAME"),
        "{message}"
    );
}

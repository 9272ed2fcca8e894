//! The output file of `lookdown calibration fit`, if there is a calibration in it.

use serde_json::{Value, json};

use crate::{assert_fails_with, lookdown};

/// Fits the sample office into a file and returns the program's output.
fn fit_into(file: &str, more: &[&str]) -> std::process::Output {
    let fit = [
        "calibration",
        "fit",
        "samples/office.jpg",
        "--lens",
        "equidistant",
    ];
    lookdown(
        &[&fit[..], &["--id", "office", "--out", file], more].concat(),
        &[],
    )
}

/// A calibration of the office with a zone, and a lens and a height that were given.
fn user_calibration(folder: &tempfile::TempDir) -> String {
    let file = folder.path().join("office.json");
    let mut calibration: Value =
        serde_json::from_slice(&std::fs::read("samples/calibrations/office.json").unwrap())
            .unwrap();
    calibration["zones"] = json!([{"name": "desk", "floor_m": [[0, 0], [1, 0], [1, 1]]}]);
    calibration["sources"] = json!({
        "lens": {"source": "given"},
        "height_m": {"source": "given"},
        "yaw_deg": {"source": "from_people", "uncertainty": 0.2},
    });
    std::fs::write(&file, calibration.to_string()).unwrap();
    file.to_str().unwrap().to_owned()
}

#[test]
fn values_of_the_user_are_not_replaced_by_found_ones() {
    let folder = tempfile::tempdir().unwrap();
    let file = user_calibration(&folder);
    let before = std::fs::read(&file).unwrap();
    assert_fails_with(
        &fit_into(&file, &[]),
        &["lens given", "world_up of unknown source", "--replace"],
    );
    assert_fails_with(&fit_into(&file, &["--circle-only"]), &["--replace"]);
    assert_eq!(std::fs::read(&file).unwrap(), before);
}

#[test]
fn replaced_lens_leaves_zones_and_height() {
    let folder = tempfile::tempdir().unwrap();
    let file = user_calibration(&folder);
    let fitted = fit_into(&file, &["--replace"]);
    assert!(fitted.status.success(), "{fitted:?}");
    let found: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    let source = |value: &str| found["sources"][value]["source"].clone();
    assert_eq!(
        (source("lens"), source("lens_model"), source("height_m")),
        ("measured".into(), "given".into(), "given".into())
    );
    assert_eq!(source("yaw_deg"), "from_people");
    assert_eq!(found["zones"][0]["name"], "desk");
    assert_eq!(found["mount"]["height_m"], 2.9);
    let with_people = fit_into(&file, &["--replace", "--people"]);
    let said = String::from_utf8_lossy(&with_people.stderr);
    assert!(
        said.contains("mount.height_m is 2.9 m") && !with_people.status.success(),
        "{said}"
    );
}

#[test]
fn assumed_values_are_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("office.json");
    let file = file.to_str().unwrap();
    assert!(fit_into(file, &["--circle-only"]).status.success());
    let mut calibration: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    calibration["sources"]["center"]["source"] = "assumed".into();
    std::fs::write(file, calibration.to_string()).unwrap();
    assert!(fit_into(file, &[]).status.success());
}

#[test]
fn other_files_are_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("office.jpg");
    std::fs::copy("samples/office.jpg", &image).unwrap();
    let fitted = fit_into(image.to_str().unwrap(), &["--replace"]);
    assert_fails_with(&fitted, &["exists", "name another file"]);
    let frame = image.to_str().unwrap();
    for fit in [
        ["fit", frame, "--lens", "equidistant", "--preview", frame],
        [
            "check",
            "samples/calibrations/office.json",
            "--preview",
            frame,
            "--out",
            frame,
        ],
    ] {
        let refused = lookdown(&[&["calibration"][..], &fit[..]].concat(), &[]);
        assert_fails_with(&refused, &["is a frame", "name another file"]);
    }
    assert_eq!(
        std::fs::read(image).unwrap(),
        std::fs::read("samples/office.jpg").unwrap()
    );
}

#[test]
fn sources_without_meaning_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (sources, fault) in [
        (json!({"bogus": {"source": "given"}}), "bogus"),
        (
            json!({"lens": {"source": "measured", "uncertainty": -5}}),
            "uncertainty is -5",
        ),
    ] {
        let file = folder.path().join("office.json");
        let mut calibration: Value =
            serde_json::from_slice(&std::fs::read("samples/calibrations/office.json").unwrap())
                .unwrap();
        calibration["sources"] = sources;
        std::fs::write(&file, calibration.to_string()).unwrap();
        let checked = lookdown(&["calibration", "check", file.to_str().unwrap()], &[]);
        let said = [checked.stdout, checked.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        assert!(!checked.status.success() && said.contains(fault), "{said}");
    }
}

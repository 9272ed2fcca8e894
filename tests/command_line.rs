//! The executable: what it prints where, and how it ends.
#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::process::{Command, Output};

use lookdown::access::KeyList;

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
fn a_folder_of_pictures_becomes_annotations_instead_of_reports() {
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
fn pictures_that_would_share_their_annotations_are_refused_before_anything_is_loaded() {
    let flags = ["--format", "voc", "--out", "/nowhere/labels"];
    let arguments = [&["detect", "a/1.jpg", "b/1.png"], &flags[..]].concat();
    let output = lookdown(&arguments, &[]);
    assert_fails_with(&output, &["--format voc", "a/1.jpg", "b/1.png"]);
}

#[test]
fn turned_boxes_are_refused_where_the_format_has_none() {
    let flags = ["--format", "yolo", "--out", "labels", "--oriented"];
    let output = lookdown(&[&["detect", "a.jpg"], &flags[..]].concat(), &[]);
    assert_fails_with(&output, &["--oriented", "yolo", "cvat"]);
}

/// The samples as a data set folder with the truth as detections, one missing and one made up.
fn samples_with_detections() -> tempfile::TempDir {
    let samples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("samples");
    let folder = tempfile::tempdir().unwrap();
    let calibrations = folder.path().join("calibrations");
    std::fs::create_dir(&calibrations).unwrap();
    for name in ["office", "canteen", "lounge"] {
        let file = format!("{name}.json");
        std::fs::copy(
            samples.join("calibrations").join(&file),
            calibrations.join(&file),
        )
        .unwrap();
    }
    let text = std::fs::read_to_string(samples.join("annotations.json")).unwrap();
    std::fs::write(folder.path().join("annotations.json"), &text).unwrap();
    let truth: serde_json::Value = serde_json::from_str(&text).unwrap();
    let persons = truth["annotations"].as_array().unwrap();
    let result = |image: &serde_json::Value, bbox: serde_json::Value, score: f64| serde_json::json!({"image_id": image, "category_id": 1, "bbox": bbox, "score": score});
    let found = persons[1..].iter();
    let mut results: Vec<_> = found
        .map(|person| result(&person["image_id"], person["bbox"].clone(), 0.9))
        .collect();
    let nowhere = serde_json::json!([0, 0, 10, 10]);
    results.push(result(&persons[0]["image_id"], nowhere, 0.95));
    let rows = folder.path().join("rows");
    std::fs::create_dir(&rows).unwrap();
    let results = serde_json::Value::from(results).to_string();
    std::fs::write(rows.join("paper.nms.tiny.json"), &results).unwrap();
    std::fs::write(rows.join("another detector.json"), &results).unwrap();
    folder
}

#[test]
fn saved_detections_are_scored_and_plotted_without_looking() {
    let folder = samples_with_detections();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (rows, plot) = (path("rows"), path("curves.svg"));
    let data_set = folder.path().to_str().unwrap();
    let flags = ["--from-detections", &rows, "--json", "--plot", &plot];
    let no_library = [("LOOKDOWN__INFERENCE__LIBRARY_PATH", "/nowhere.so")];
    let output = lookdown(&[&["eval", data_set], &flags[..]].concat(), &no_library);
    assert!(output.status.success(), "{output:?}");
    let lines = String::from_utf8(output.stdout).unwrap();
    let rows: Vec<serde_json::Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(rows[0]["profile"], serde_json::Value::Null);
    assert_eq!(rows[0]["model"], "another detector");
    assert_eq!(
        (&rows[1]["profile"], &rows[1]["refine"]),
        (&"paper".into(), &"nms".into())
    );
    for row in &rows {
        assert_eq!((&row["persons"], &row["images"]), (&18.into(), &3.into()));
        // 17 of 18 persons at a precision of 17 / 18.
        let expected = (17.0 / 18.0) * (17.0 / 18.0);
        assert!(
            (row["ap50"].as_f64().unwrap() - expected).abs() < 1e-9,
            "{row}"
        );
        assert_eq!(row["seconds_per_image"], serde_json::Value::Null);
    }
    let svg = std::fs::read_to_string(plot).unwrap();
    assert!(svg.contains("another detector") && svg.contains("paper nms tiny"));
}

#[test]
fn saved_detections_are_scored_by_stratum() {
    let folder = samples_with_detections();
    let rows = folder.path().join("rows/paper.nms.tiny.json");
    let data_set = folder.path().to_str().unwrap();
    let by = ["--by", "size", "--by", "visibility"];
    let flags = ["--from-detections", rows.to_str().unwrap()];
    let arguments = [&["eval", data_set], &flags[..], &by].concat();
    let table = lookdown(&arguments, &[]);
    assert!(table.status.success(), "{table:?}");
    let table = String::from_utf8(table.stdout).unwrap();
    assert_eq!(table.lines().count(), 1 + 1 + 3 + 3, "{table}");
    assert!(table.contains("90% visible and more"), "{table}");

    let json = lookdown(&[&arguments[..], &["--json"]].concat(), &[]);
    let row: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    for by in ["size", "visibility"] {
        let strata = row["strata"].as_array().unwrap().iter();
        let persons = strata.filter(|stratum| stratum["by"] == by);
        let persons: u64 = persons.filter_map(|s| s["persons"].as_u64()).sum();
        assert_eq!(persons, 18, "{row}");
    }

    let output = lookdown(&[&arguments[..4], &["--by", "age"]].concat(), &[]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("distance, size, visibility"), "{message}");
}

#[test]
fn a_calibration_for_every_picture_must_exist() {
    let folder = samples_with_detections();
    let data_set = folder.path().to_str().unwrap();
    let flags = [
        "--from-detections",
        "x.json",
        "--calibration",
        "no/such.json",
    ];
    let output = lookdown(&[&["eval", data_set], &flags[..]].concat(), &[]);
    assert_fails_with(&output, &["--calibration", "no/such.json"]);
}

#[test]
fn a_sweep_takes_one_profile() {
    let flags = ["--sweep", "out", "--profile", "fast", "--profile", "paper"];
    let output = lookdown(&[&["eval", "somewhere"], &flags[..]].concat(), &[]);
    assert_fails_with(&output, &["--sweep", "one --profile"]);
}

#[test]
fn a_calibration_is_fitted_to_frames_and_says_what_it_assumes() {
    let fitted = lookdown(
        &[
            "calibration",
            "fit",
            "samples/office.jpg",
            "--id",
            "office",
            "--height",
            "2.8",
        ],
        &[],
    );
    assert!(fitted.status.success(), "{fitted:?}");
    let said = String::from_utf8_lossy(&fitted.stderr);
    assert!(said.contains("not measured"), "{said}");
    let found: serde_json::Value = serde_json::from_slice(&fitted.stdout).unwrap();
    let truth = std::fs::read("samples/calibrations/office.json").unwrap();
    let truth: serde_json::Value = serde_json::from_slice(&truth).unwrap();
    assert_eq!(
        (&found["id"], &found["mount"]["height_m"]),
        (&"office".into(), &2.8.into())
    );
    let radius = |lens: &serde_json::Value| {
        lens["focal"].as_f64().unwrap() * lens["max_theta"].as_f64().unwrap()
    };
    let allowed = 0.005 * radius(&truth["lens"]);
    assert!(
        (radius(&found["lens"]) - radius(&truth["lens"])).abs() < allowed,
        "{found}"
    );
    for center in ["cx", "cy"] {
        let off = found["lens"][center].as_f64().unwrap() - truth["lens"][center].as_f64().unwrap();
        assert!(off.abs() < allowed, "{center}: {found}");
    }
}

#[test]
fn frames_without_a_lens_circle_are_not_fitted() {
    let folder = tempfile::TempDir::new().unwrap();
    let bright = folder.path().join("bright.png");
    image::RgbImage::from_pixel(64, 64, image::Rgb([200; 3]))
        .save(&bright)
        .unwrap();
    let fitted = lookdown(&["calibration", "fit", bright.to_str().unwrap()], &[]);
    let said = String::from_utf8(fitted.stderr).unwrap();
    assert_eq!(fitted.status.code(), Some(1), "{said}");
    assert!(fitted.stdout.is_empty());
    let said: Vec<_> = said.lines().collect();
    assert!(
        said[0].ends_with("bright.png: shows no lens circle"),
        "{said:?}"
    );
    assert!(said[1].contains("give brighter frames"), "{said:?}");
}

#[test]
fn a_calibration_of_another_program_is_checked_and_converted() {
    let camchain = "tests/fixtures/calibrations/kalibr_camchain.yaml";
    let checked = lookdown(&["calibration", "check", camchain], &[]);
    assert!(checked.status.success());
    let report = String::from_utf8(checked.stdout).unwrap();
    for expected in [
        "Kalibr camchain, 4 cameras",
        "calibration  kalibr_camchain-cam2",
        "  lens       double_sphere",
        "  frame      752×480 pixels",
    ] {
        assert!(report.contains(expected), "{report}");
    }

    let several = lookdown(&["calibration", "convert", camchain], &[]);
    assert_fails_with(&several, &["--camera", "cam0, cam1, cam2, cam3"]);
    let folder = tempfile::tempdir().unwrap();
    let native = folder.path().join("hall.json");
    let native = native.to_str().unwrap();
    let arguments = ["--camera", "cam0", "--id", "hall", "--out", native];
    let converted = lookdown(
        &[&["calibration", "convert", camchain][..], &arguments].concat(),
        &[],
    );
    assert!(converted.status.success());
    let calibration = lookdown::calibration::Calibration::read(native.as_ref()).unwrap();
    assert_eq!(calibration.id().as_str(), "hall");
    assert_eq!(calibration.image_size(), (512, 512));
}

#[test]
fn a_calibration_that_cannot_be_used_is_explained_and_costs_the_exit_code() {
    let file = "tests/fixtures/calibrations/ros_plumb_bob_called_fisheye.yaml";
    let output = lookdown(&["calibration", "check", file], &[]);
    assert_eq!(output.status.code(), Some(1));
    let report = String::from_utf8(output.stdout).unwrap();
    assert!(
        report.contains("refused    distortion_model: it is plumb_bob"),
        "{report}"
    );
}

#[test]
fn a_frame_size_is_given_only_where_the_file_has_none() {
    let file = "tests/fixtures/calibrations/py_ocamcalib.json";
    let arguments = ["calibration", "check", file, "--size", "1600x1600"];
    let report = String::from_utf8(lookdown(&arguments, &[]).stdout).unwrap();
    assert!(report.contains("  frame      1600×1600 pixels"), "{report}");
    let file = "tests/fixtures/calibrations/woodscape.json";
    let output = lookdown(&["calibration", "check", file, "--size", "640x480"], &[]);
    assert_fails_with(&output, &["--size", "1280x966"]);
}

#[test]
fn a_preview_shows_the_lens_in_the_frame() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("preview.jpg");
    let output = lookdown(
        &[
            "calibration",
            "check",
            "samples/calibrations/office.json",
            "--preview",
            "samples/office.jpg",
            "--out",
            out.to_str().unwrap(),
        ],
        &[],
    );
    assert!(output.status.success());
    let limits = lookdown::imaging::decode::DecodeLimits::default();
    let frame = lookdown::imaging::decode::decode(&std::fs::read(out).unwrap(), &limits)
        .unwrap()
        .frame;
    assert_eq!((frame.width(), frame.height()), (960, 960));
    // The rim is red at the left edge of the circle.
    let start = 3 * (480 * 960 + 1);
    let [red, green, blue] = [0, 1, 2].map(|channel| frame.pixels()[start + channel]);
    assert!(
        red > 180 && green < 140 && blue < 140,
        "{red} {green} {blue}"
    );
}

#[test]
fn a_new_key_comes_with_the_line_that_makes_it_known() {
    let scopes = ["--scope", "read", "--scope", "detect"];
    let new = || {
        lookdown(
            &[&["key", "new", "--name", "gate"], &scopes[..]].concat(),
            &[],
        )
    };
    let output = new();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    let lines: Vec<_> = text.lines().filter(|line| !line.starts_with('#')).collect();
    let [key, file_line, entry] = lines[..] else {
        panic!("{text}");
    };
    let file = KeyList::from_toml(file_line).unwrap();
    assert_eq!(file, entry.parse().unwrap());
    let holder = file.holder_of(key.as_bytes()).unwrap();
    assert_eq!(holder.name.to_string(), "gate");
    assert_eq!(holder.scopes.joined("+"), "detect+read");
    assert_ne!(new().stdout, output.stdout);
}

#[test]
fn a_key_without_a_scope_or_with_an_odd_name_is_not_made() {
    for arguments in [
        &["key", "new", "--name", "gate"][..],
        &["key", "new", "--name", "gate", "--scope", "root"],
        &["key", "new", "--name", "a.b", "--scope", "read"],
    ] {
        let output = lookdown(arguments, &[]);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty());
    }
}

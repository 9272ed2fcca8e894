//! `lookdown eval`

use crate::{assert_fails_with, lookdown};

/// Creates a data set of the samples with the ground truth as detections, one missing and one
/// added.
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
fn saved_detections_are_scored_without_a_model() {
    let folder = samples_with_detections();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let rows = path("rows");
    let data_set = folder.path().to_str().unwrap();
    let flags = ["--from-detections", &rows, "--json"];
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
}

#[test]
fn counts_are_printed_also_for_empty_rooms() {
    let folder = samples_with_detections();
    let row = |data_set: &std::path::Path| {
        let rows = folder.path().join("rows/paper.nms.tiny.json");
        let flags = ["--from-detections", rows.to_str().unwrap(), "--json"];
        let output = lookdown(
            &[&["eval", data_set.to_str().unwrap()], &flags[..]].concat(),
            &[],
        );
        assert!(output.status.success(), "{output:?}");
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()
    };
    let with_persons = row(folder.path());
    // One false person and one missed person, in the same image.
    let third = 1.0 / 3.0;
    assert_eq!(with_persons["false_persons"], third);
    assert_eq!(with_persons["missed_persons"], third);
    assert_eq!(with_persons["count_error"], 0.0);
    assert_eq!(
        with_persons["false_in_empty_images"],
        serde_json::Value::Null
    );

    let path = folder.path().join("annotations.json");
    let mut truth: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    truth["annotations"] = serde_json::json!([]);
    std::fs::write(&path, truth.to_string()).unwrap();
    let empty = row(folder.path());
    assert_eq!(empty["ap50"], serde_json::Value::Null);
    assert_eq!(
        (&empty["persons"], &empty["empty_images"]),
        (&0.into(), &3.into())
    );
    assert_eq!(empty["false_in_empty_images"], 1.0);
    assert_eq!(empty["count_error"], 6.0);
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
fn the_calibration_for_every_image_must_exist() {
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

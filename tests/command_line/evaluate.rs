//! `lookdown eval` on data sets of every format, made from the detections of `lookdown detect` in a
//! sample. A second run must agree with the first, including angles.

use std::{
    path::Path,
    process::{Command, Output},
};

use serde_json::{Value, json};

const FLAGS: [&str; 6] = [
    "--profile",
    "fast",
    "--refine",
    "fusion",
    "--score-threshold",
    "0.2",
];

fn lookdown(arguments: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_lookdown"))
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(arguments)
        .args(FLAGS)
        .output()
        .unwrap();
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{complaint}");
    output
}

/// The persons detected in the sample, without a calibration.
fn found() -> Vec<Value> {
    let output = lookdown(&["detect", "samples/office.jpg"]);
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let persons = report["persons"].as_array().unwrap().clone();
    assert!(persons.len() >= 3, "{persons:?}");
    persons
}

fn numbers<const N: usize>(object: &Value, names: [&str; N]) -> [f64; N] {
    names.map(|name| object[name].as_f64().unwrap())
}

fn corners(person: &Value) -> [f64; 4] {
    numbers(&person["box"], ["x_min", "y_min", "x_max", "y_max"])
}

/// The row that `lookdown eval` prints for a folder with the sample and these files.
fn evaluated(image_name: &str, files: &[(&str, String)]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        path
    };
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/office.jpg");
    std::fs::copy(sample, place(image_name)).unwrap();
    for (name, content) in files {
        std::fs::write(place(name), content).unwrap();
    }
    let output = lookdown(&["eval", folder.path().to_str().unwrap(), "--json"]);
    serde_json::from_slice(&output.stdout).unwrap()
}

#[track_caller]
fn assert_all_were_detected(row: &Value, persons: usize) {
    assert_eq!(row["persons"], persons);
    for figure in ["ap50", "ap75", "recall"] {
        assert_eq!(row[figure], 1.0, "{figure} in {row}");
    }
}

/// A COCO file of the sample with these boxes.
fn coco_file(boxes: impl Iterator<Item = Vec<f64>>) -> String {
    let annotations: Vec<_> = boxes
        .map(|bbox| json!({"image_id": "office", "bbox": bbox}))
        .collect();
    let image = json!({"id": "office", "file_name": "o.jpg", "width": 960, "height": 960});
    json!({"images": [image], "annotations": annotations}).to_string()
}

#[test]
fn rotated_boxes_match_their_oriented_boxes() {
    let found = found();
    let boxes = found.iter().map(|person| {
        let names = ["cx", "cy", "width", "height", "angle_deg"];
        numbers(&person["oriented_box"], names).to_vec()
    });
    let file = ("annotations/office.json", coco_file(boxes));
    let row = evaluated("office/o.jpg", &[file]);
    assert_all_were_detected(&row, found.len());
}

#[test]
fn annotations_in_the_format_of_cepdof_are_matched() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let flags = ["--format", "cepdof", "--out", out];
    lookdown(&[&["detect", "samples/office.jpg"], &flags[..]].concat());
    let file = std::fs::read_to_string(folder.path().join("annotations.json")).unwrap();
    let row = evaluated("images/office.jpg", &[("annotations.json", file)]);
    assert_all_were_detected(&row, found().len());
}

#[test]
fn boxes_of_a_coco_file_are_matched() {
    let found = found();
    let boxes = found.iter().map(|person| {
        let [x_min, y_min, x_max, y_max] = corners(person);
        vec![x_min, y_min, x_max - x_min, y_max - y_min]
    });
    let row = evaluated("images/o.jpg", &[("annotations.json", coco_file(boxes))]);
    assert_all_were_detected(&row, found.len());
}

#[test]
fn boxes_of_voc_files_are_matched() {
    let found = found();
    let objects = found.iter().map(|person| {
        let [x_min, y_min, x_max, y_max] = corners(person);
        format!(
            "<object><name>person</name><bndbox><xmin>{x_min}</xmin><ymin>{y_min}</ymin>\
             <xmax>{x_max}</xmax><ymax>{y_max}</ymax></bndbox></object>"
        )
    });
    let objects: Vec<_> = objects.collect();
    let xml = format!("<annotation>{}</annotation>", objects.concat());
    let row = evaluated("JPEGImages/o.jpg", &[("Annotations/o.xml", xml)]);
    assert_all_were_detected(&row, found.len());
}

#[test]
fn heads_match_the_boxes_that_contain_them() {
    let found = found();
    let heads = found.iter().map(|person| {
        let [x_min, y_min, x_max, y_max] = corners(person);
        let (x, y) = (f64::midpoint(x_min, x_max), f64::midpoint(y_min, y_max));
        format!(",{x},{y}")
    });
    let heads: Vec<_> = heads.collect();
    let csv = "Ground_Truth_Annotations/groundTruth_omni1A_test1.csv";
    let row = evaluated(
        "omni1A_test1/o.jpg",
        &[(csv, format!("1{}\n", heads.concat()))],
    );
    assert_all_were_detected(&row, found.len());
}

#[test]
fn turned_views_see_the_same_persons_differently() {
    let folder = tempfile::tempdir().unwrap();
    let detections = |turn: &str| {
        let saved = folder.path().join(turn);
        let flags = [
            "--turn-deg",
            turn,
            "--save-detections",
            saved.to_str().unwrap(),
        ];
        lookdown(&[&["eval", "samples", "--json"], &flags[..]].concat());
        let file = saved.read_dir().unwrap().next().unwrap().unwrap();
        std::fs::read_to_string(file.path()).unwrap()
    };
    assert_ne!(detections("0"), detections("36"));
}

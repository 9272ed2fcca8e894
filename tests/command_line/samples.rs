//! The shipped samples with the real binary and the real models, as in the quick start.

use std::{path::Path, process::Command, sync::Arc};

use lookdown_calibration::Calibration;
use lookdown_detect::{Detector, DetectorOptions, parameters::DetectParameters};
use lookdown_imaging::decode::{DecodeLimits, decode};
use serde_json::Value;

/// `x_min, y_min, x_max, y_max`.
type Corners = [f64; 4];

struct Annotated {
    corners: Corners,
    distance_m: f64,
    on_their_feet: bool,
}

/// The report of `lookdown detect samples/NAME.jpg FLAGS...`.
fn detect(name: &str, flags: &[&str]) -> Value {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let output = Command::new(env!("CARGO_BIN_EXE_lookdown"))
        .current_dir(root)
        .arg("detect")
        .arg(format!("samples/{name}.jpg"))
        .args(flags)
        .output()
        .unwrap();
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{complaint}");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn corners(person: &Value) -> Corners {
    ["x_min", "y_min", "x_max", "y_max"].map(|side| person["box"][side].as_f64().unwrap())
}

fn persons(report: &Value) -> &Vec<Value> {
    report["persons"].as_array().unwrap()
}

fn annotated(name: &str) -> Vec<Annotated> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/annotations.json");
    let file: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let images = file["images"].as_array().unwrap();
    let file_name = format!("{name}.jpg");
    let image = images
        .iter()
        .find(|image| image["file_name"] == file_name.as_str())
        .unwrap();
    let annotations = file["annotations"].as_array().unwrap();
    let of_image = annotations
        .iter()
        .filter(|annotation| annotation["image_id"] == image["id"]);
    of_image
        .map(|annotation| {
            let [x, y, width, height] =
                [0, 1, 2, 3].map(|side| annotation["bbox"][side].as_f64().unwrap());
            Annotated {
                corners: [x, y, x + width, y + height],
                distance_m: annotation["distance_m"].as_f64().unwrap(),
                on_their_feet: annotation["pose"] != "sitting",
            }
        })
        .collect()
}

fn iou(a: Corners, b: Corners) -> f64 {
    let area = |c: Corners| (c[2] - c[0]).max(0.0) * (c[3] - c[1]).max(0.0);
    let common = area([
        a[0].max(b[0]),
        a[1].max(b[1]),
        a[2].min(b[2]),
        a[3].min(b[3]),
    ]);
    common / (area(a) + area(b) - common)
}

#[test]
fn the_office_persons_are_found_exactly_without_a_calibration() {
    let report = detect("office", &[]);
    assert_eq!(report["calibration"]["assumed"], true);
    let expected = annotated("office");
    for person in &expected {
        let best = persons(&report)
            .iter()
            .map(|found| iou(corners(found), person.corners))
            .fold(0.0, f64::max);
        assert!(
            best >= 0.5,
            "{:?} was missed (best IoU {best:.2})",
            person.corners
        );
    }
    assert_eq!(persons(&report).len(), expected.len());
}

/// The record of `tests/fixtures/make_sample_persons.py`.
#[test]
fn every_cpu_finds_the_recorded_persons() {
    let record: Value =
        serde_json::from_str(include_str!("../fixtures/sample_persons.json")).unwrap();
    for row in record.as_array().unwrap() {
        let flags = row["flags"].as_array().unwrap();
        let flags: Vec<_> = flags.iter().map(|flag| flag.as_str().unwrap()).collect();
        let report = detect(row["sample"].as_str().unwrap(), &flags);
        let recorded = row["persons"].as_array().unwrap();
        assert!(
            are_same(persons(&report), recorded),
            "{row} is not {report}"
        );
    }
}

/// True if each person has a recorded one with nearly the same sides and score, and none is left.
fn are_same(found: &[Value], recorded: &[Value]) -> bool {
    let mut left: Vec<_> = found.iter().collect();
    for person in recorded {
        let expected = [0, 1, 2, 3].map(|side| person["box"][side].as_f64().unwrap());
        let size = (expected[2] - expected[0]).hypot(expected[3] - expected[1]);
        let score = person["score"].as_f64().unwrap();
        let is_same = |other: &&Value| {
            let sides = corners(other).into_iter().zip(expected);
            sides.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) < 0.02 * size
                && (other["score"].as_f64().unwrap() - score).abs() < 0.03
        };
        let Some(place) = left.iter().position(is_same) else {
            return false;
        };
        left.remove(place);
    }
    left.is_empty()
}

#[test]
fn floor_positions_are_where_people_stand() {
    let mut checked = 0;
    for name in ["office", "lounge"] {
        let calibration = format!("samples/calibrations/{name}.json");
        let report = detect(name, &["--calibration", &calibration]);
        // The feet of sitting people are not at their floor position.
        for person in annotated(name).iter().filter(|person| person.on_their_feet) {
            let found = persons(&report)
                .iter()
                .find(|found| iou(corners(found), person.corners) >= 0.5)
                .unwrap();
            let axis = |axis: &str| found["floor"][axis].as_f64().unwrap();
            let distance_m = axis("x_m").hypot(axis("y_m"));
            assert!(
                (distance_m - person.distance_m).abs() < 0.5,
                "{name}: {distance_m:.2} m instead of {:.2} m",
                person.distance_m
            );
            checked += 1;
        }
    }
    assert_eq!(checked, 4, "four people stand or walk");
}

#[test]
fn the_paper_s_refinements_differ_as_their_formulas_require() {
    let scores = |refinement: &str| -> Vec<f64> {
        let flags = [
            "--profile",
            "paper",
            "--refine",
            refinement,
            "--score-threshold",
            "0.2",
        ];
        let report = detect("office", &flags);
        assert_eq!(report["refinement"]["name"], refinement);
        let persons = persons(&report).iter();
        persons
            .map(|person| person["score"].as_f64().unwrap())
            .collect()
    };
    let [hard, linear, gaussian] = ["nms", "soft_nms_linear", "soft_nms_gaussian"].map(scores);
    // No box is selected before the best one, so all three refinements keep its score.
    assert_eq!(hard[0], linear[0]);
    assert_eq!(hard[0], gaussian[0]);
    // Linear Soft-NMS lowers scores that hard NMS removes, so it keeps more detections.
    assert!(
        linear.len() > hard.len(),
        "{} and {}",
        linear.len(),
        hard.len()
    );
    // The Gaussian lowers every overlapping score, also below N_t = 0.5, where linear does not.
    let sum = |scores: &[f64]| scores.iter().sum::<f64>();
    assert!(sum(&gaussian) < sum(&linear), "{gaussian:?} and {linear:?}");
}

#[test]
fn report_names_the_models_of_views_and_crops() {
    let names = |report: &Value| {
        ["model", "crop_model"].map(|part| {
            let name = report.get(part).map(|model| model["name"].as_str());
            name.map(|name| name.unwrap().to_owned())
        })
    };
    let some = |name: &str| Some(name.to_owned());
    let (views, crops) = (some("nanodet_g_views_416"), some("nanodet_g_fisheye_416"));
    let fast = detect("office", &["--profile", "fast"]);
    assert_eq!(names(&fast), [views.clone(), crops]);
    let direct = detect("office", &["--profile", "direct"]);
    assert_eq!(names(&direct), [views, None]);
}

#[test]
fn named_model_processes_the_crops_as_well() {
    let report = detect(
        "office",
        &["--profile", "fast", "--model", "nanodet_g_views_416"],
    );
    assert!(report.get("crop_model").is_none());
}

#[test]
fn the_library_detects_the_persons_that_the_command_reports() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let detector = Detector::new(&DetectorOptions {
        onnx_runtime: root.join("runtime/libonnxruntime.so"),
        models: root.join("models"),
        ..DetectorOptions::default()
    });
    let content = std::fs::read(root.join("samples/office.jpg")).unwrap();
    let frame = decode(&content, &DecodeLimits::default()).unwrap().frame;
    let camera = Calibration::read(&root.join("samples/calibrations/office.json")).unwrap();
    let parameters = DetectParameters::parse([("profile", "fast")]).unwrap();
    let found = detector
        .unwrap()
        .detect(Arc::new(frame), Some(Arc::new(camera)), &parameters)
        .unwrap();

    let calibration = "samples/calibrations/office.json";
    let report = detect(
        "office",
        &["--profile", "fast", "--calibration", calibration],
    );
    assert!(!found.persons.is_empty());
    assert_eq!(found.persons.len(), persons(&report).len());
    for (person, reported) in found.persons.iter().zip(persons(&report)) {
        for (side, expected) in person.bbox.corners().into_iter().zip(corners(reported)) {
            assert!((side - expected).abs() < 0.01, "{person:?}, {reported}");
        }
    }
}

#[test]
fn the_samples_are_a_data_set() {
    let samples = concat!(env!("CARGO_MANIFEST_DIR"), "/samples");
    let arguments = [
        "eval",
        samples,
        "--profile",
        "direct",
        "--refine",
        "nms",
        "--json",
    ];
    let output = crate::lookdown(&arguments, &[]);
    assert!(output.status.success(), "{output:?}");
    let row: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&row["images"], &row["persons"]), (&3.into(), &18.into()));
}

#[test]
fn an_annotated_image_of_another_format_is_refused() {
    let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/office.jpg");
    let output = crate::lookdown(&["detect", sample, "--annotate", "drawn.gif"], &[]);
    crate::assert_fails_with(&output, &["--annotate", "drawn.gif", ".png"]);
}

//! The paper's detector at full size, from darknet's files to boxes.

use std::{fs, path::Path, process::Command};

use lookdown_detect::inference::{CandidateOptions, Detector, OnnxDetector, OnnxOptions};
use lookdown_imaging::{Frame, Letterbox, ViewBatch};
use serde_json::Value;
use tempfile::TempDir;

use crate::models::folder::{in_repository, library, options};

const SIZE: u32 = 416;

/// Runs one of the repository's scripts in the converters' environment.
fn script(name: &str, arguments: &[&Path]) {
    let output = Command::new(in_repository(".setup/venv/bin/python"))
        .arg(in_repository("packaging/scripts").join(name))
        .args(arguments)
        .output()
        .unwrap();
    assert!(output.status.success(), "{name}: {output:?}");
}

/// The image of `tests/fixtures/models/make_yolov2_answers.py`.
fn image() -> Frame {
    let level = |place: u32| u8::try_from(place * 255 / (SIZE - 1)).unwrap();
    let pixels = (0..SIZE * SIZE).flat_map(|index| {
        let (row, column) = (index / SIZE, index % SIZE);
        let is_square = (row / 32 + column / 32) % 2 == 1;
        [level(column), level(row), if is_square { 255 } else { 0 }]
    });
    Frame::new(SIZE, SIZE, pixels.collect()).unwrap()
}

#[test]
fn full_size_yolov2_matches_the_reference() {
    let folder = TempDir::new().unwrap();
    let model = folder.path().join("yolov2");
    script("made_up_yolov2.py", &[folder.path()]);
    let [cfg, weights] =
        ["cfg", "weights"].map(|kind| folder.path().join(format!("yolov2.{kind}")));
    script("convert_darknet.py", &[&cfg, &weights, &model]);
    let thresholds_off = OnnxOptions {
        candidates: CandidateOptions {
            score_floor: 0.0,
            max_detections_per_view: 1000,
        },
        ..options()
    };
    let mut detector = OnnxDetector::load(&library(), &model, &thresholds_off).unwrap();

    let input = detector.input().clone();
    let mut batch = ViewBatch::default();
    for slot in batch.prepare(1, &input) {
        Letterbox::new(SIZE, SIZE, &input).render(&image(), &input, slot);
    }
    let mut found = detector.detect(&batch).unwrap().per_view.remove(0);
    found.sort_by(|a, b| b.score.total_cmp(&a.score));

    let answers = in_repository("tests/fixtures/models/yolov2_answers.json");
    let answers: Value = serde_json::from_slice(&fs::read(answers).unwrap()).unwrap();
    assert_eq!(found.len(), answers["candidates"]);
    let sum: f64 = found.iter().map(|found| found.score).sum();
    let expected_sum = answers["score_sum"].as_f64().unwrap();
    assert!((sum - expected_sum).abs() < 1e-3, "{sum} {expected_sum}");
    let best: Vec<[f64; 5]> = serde_json::from_value(answers["best"].clone()).unwrap();
    for ([score, corners @ ..], found) in best.iter().zip(&found) {
        assert!((found.score - score).abs() < 1e-4, "{found:?} {score}");
        for (side, expected) in found.bbox.corners().iter().zip(corners) {
            assert!((side - expected).abs() < 0.05, "{found:?} {corners:?}");
        }
    }
}

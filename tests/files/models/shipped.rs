//! The installed models on the samples.

use std::{fs, sync::Arc};

use lookdown::{
    annotated_image::{AnnotationOptions, ImageFormat, annotated_image},
    app::engine_for,
    settings,
};
use lookdown_calibration::Calibration;
use lookdown_detect::{
    detection::{BBox, FramePixels},
    inference::ModelManifest,
    parameters::DetectParameters,
    pipeline::{DetectJob, DetectionReport, JobImage},
};
use serde_json::Value;

use crate::models::folder::in_repository;

/// Runs detection on the office sample.
fn detect(parameters: &[(&str, &str)]) -> DetectionReport {
    let settings = settings::load(None, []).unwrap();
    let parameters = DetectParameters::parse(parameters.iter().copied()).unwrap();
    let engine = engine_for(&settings, std::slice::from_ref(&parameters)).unwrap();
    let calibration = in_repository("samples/calibrations/office.json");
    let image = fs::read(in_repository("samples/office.jpg")).unwrap();
    let calibration = Arc::new(Calibration::read(&calibration).unwrap());
    let job = DetectJob::local(
        "test".to_owned(),
        JobImage::Encoded(image.into()),
        parameters,
        Some(calibration),
    );
    engine.detect(&job).unwrap().report
}

/// Boxes of the persons in the office.
fn annotated() -> Vec<BBox<FramePixels>> {
    let file = fs::read_to_string(in_repository("samples/annotations.json")).unwrap();
    let file: Value = serde_json::from_str(&file).unwrap();
    let images = file["images"].as_array().unwrap();
    let is_office = |image: &&Value| image["file_name"] == "office.jpg";
    let office = &images.iter().find(is_office).unwrap()["id"];
    let annotations = file["annotations"].as_array().unwrap().iter();
    let boxes = annotations.filter(|annotation| annotation["image_id"] == *office);
    let boxes = boxes.map(|annotation| {
        let [x, y, width, height] = [0, 1, 2, 3].map(|i| annotation["bbox"][i].as_f64().unwrap());
        BBox::new([x, y, x + width, y + height]).unwrap()
    });
    boxes.collect()
}

/// Returns how many of these persons a report has.
fn found(report: &DetectionReport, annotated: &[BBox<FramePixels>]) -> usize {
    let persons = || report.persons.iter();
    let is_found =
        |truth: &&BBox<FramePixels>| persons().any(|person| person.bbox.iou(truth) > 0.4);
    annotated.iter().filter(is_found).count()
}

#[test]
fn the_default_models_find_all_persons_of_a_sample() {
    let annotated = annotated();
    for profile in ["fast", "balanced", "quality"] {
        let report = detect(&[("profile", profile)]);
        let found = found(&report, &annotated);
        assert_eq!(found, annotated.len(), "{profile}");
    }
}

#[test]
fn every_fetched_model_finds_the_persons_of_a_sample() {
    let folders = fs::read_dir(in_repository("models")).unwrap();
    let folders = folders.map(|entry| entry.unwrap().path());
    let fetched: Vec<_> = folders
        .filter(|folder| {
            // Weights are fetched, manifests are not.
            ModelManifest::locate(folder).is_ok_and(|manifest| manifest.onnx.is_file())
        })
        .collect();
    assert!(
        fetched.len() >= 2,
        "the repository has two networks: {fetched:?}"
    );
    let annotated = annotated();
    for folder in fetched {
        let name = folder.file_name().unwrap().to_str().unwrap();
        // The views of the paper suit all models.
        let report = detect(&[
            ("model", name),
            ("profile", "paper"),
            ("score_threshold", "0.05"),
        ]);
        assert_eq!(report.model.name, name);
        let found = found(&report, &annotated);
        // The smallest model misses some persons.
        assert!(
            2 * found >= annotated.len(),
            "{name} finds {found} of {}",
            annotated.len()
        );
    }
}

#[test]
fn the_detector_finds_no_person_in_a_concealed_frame() {
    let settings = settings::load(None, []).unwrap();
    let parse = |threshold| DetectParameters::parse([("score_threshold", threshold)]).unwrap();
    let (careful, usual) = (parse("0.1"), parse("0.3"));
    let engine = engine_for(&settings, std::slice::from_ref(&usual)).unwrap();
    let calibration = in_repository("samples/calibrations/office.json");
    let calibration = Arc::new(Calibration::read(&calibration).unwrap());
    let detect = |image: Vec<u8>, parameters: &DetectParameters| {
        let job = DetectJob::local(
            "test".to_owned(),
            JobImage::Encoded(image.into()),
            parameters.clone(),
            Some(Arc::clone(&calibration)),
        );
        engine.detect(&job).unwrap()
    };
    let office = fs::read(in_repository("samples/office.jpg")).unwrap();
    let persons = detect(office.clone(), &usual).report.persons.len();
    assert!(persons >= annotated().len() - 1, "{persons}");
    for layer in ["blur", "silhouette"] {
        let detected = detect(office.clone(), &careful);
        let options = AnnotationOptions::parse([("draw", layer)]).unwrap();
        let concealed = annotated_image(detected, ImageFormat::Jpeg, &options).unwrap();
        let persons = detect(concealed, &usual).report.persons;
        let scores: Vec<_> = persons.iter().map(|person| person.score).collect();
        assert!(scores.is_empty(), "{layer}: {scores:?}");
    }
}

#[test]
fn every_manifest_has_the_sum_of_its_file() {
    let mut names = 0;
    for entry in fs::read_dir(in_repository("models")).unwrap() {
        let text = fs::read_to_string(entry.unwrap().path().join("model.toml")).unwrap();
        assert!(text.contains("\nsha256 = \""), "{text}");
        names += 1;
    }
    assert!(names >= 4, "{names}");
}

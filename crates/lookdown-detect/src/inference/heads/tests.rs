//! Floors, edges and invalid values in every head.

mod known_models;
mod refusals;

use super::{Head, HeadOutput, InferenceError, TensorView};
use crate::{detection::BBox, inference::ViewDetection};
use lookdown_imaging::NetworkInput;
use lookdown_lens::geometry::Posture;

/// The head of a manifest's `[output]` table.
fn head(manifest: &str) -> Head {
    toml::from_str(manifest).unwrap()
}

fn decode(
    head: &Head,
    outputs: &[(&str, &[usize], &[f32])],
    floor: f64,
) -> Result<HeadOutput, InferenceError> {
    let outputs: Vec<TensorView<'_>> = outputs
        .iter()
        .map(|&(name, shape, values)| TensorView {
            name,
            shape,
            values,
        })
        .collect();
    head.decode(&outputs, 1, &NetworkInput::plain(100, 50), floor)
}

/// Output for one box with one score.
fn decode_one(corners: [f32; 4], score: f32, floor: f64) -> HeadOutput {
    decode(
        &Head::default(),
        &[
            ("boxes", &[1, 1, 4], &corners),
            ("scores", &[1, 1], &[score]),
        ],
        floor,
    )
    .unwrap()
}

const INSIDE: [f32; 4] = [10.0, 10.0, 30.0, 40.0];

#[test]
fn a_box_beyond_the_view_is_clipped_to_it() {
    let found = decode_one([-20.0, 10.0, 130.0, 70.0], 0.9, 0.5);
    let clipped = BBox::new([0.0, 10.0, 100.0, 50.0]).unwrap();
    assert_eq!(found.per_view[0][0].bbox, clipped);
}

#[test]
fn boxes_without_area_in_the_view_are_dropped_and_not_counted() {
    for corners in [
        [110.0, 10.0, 130.0, 30.0],
        [100.0, 10.0, 130.0, 30.0],
        [10.0, 10.0, 10.0, 30.0],
        [30.0, 10.0, 10.0, 30.0],
    ] {
        let found = decode_one(corners, 0.9, 0.5);
        assert_eq!((found.per_view[0].len(), found.non_finite), (0, 0));
    }
}

#[test]
fn values_that_are_not_finite_are_dropped_and_counted() {
    let [x_min, y_min, x_max, _] = INSIDE;
    for (corners, score) in [
        (INSIDE, f32::NAN),
        (INSIDE, f32::INFINITY),
        (INSIDE, f32::NEG_INFINITY),
        ([f32::NAN, y_min, x_max, 40.0], 0.9),
        ([x_min, y_min, x_max, f32::INFINITY], 0.9),
        ([x_min, y_min, x_max, 1e20], 0.9),
    ] {
        let found = decode_one(corners, score, 0.5);
        assert_eq!((found.per_view[0].len(), found.non_finite), (0, 1));
    }
}

#[test]
fn the_box_of_a_low_score_is_not_computed() {
    let found = decode_one([f32::NAN; 4], 0.4, 0.5);
    assert_eq!((found.per_view[0].len(), found.non_finite), (0, 0));
}

#[test]
fn an_exponential_beyond_any_image_is_counted() {
    let yolo = head("head = 'yolo_v2'\nperson_class = 0\nanchors = [[1, 1]]");
    let raw = [0.0, 0.0, 1000.0, 0.0, 9.0, 9.0];
    let found = decode(&yolo, &[("grid", &[1, 6, 1, 1], &raw)], 0.5).unwrap();
    assert_eq!((found.per_view[0].len(), found.non_finite), (0, 1));
}

#[test]
fn only_the_person_class_counts() {
    let rows = head("head = 'end_to_end'\nperson_class = 2");
    let row = |class: f32| [10.0, 10.0, 30.0, 40.0, 0.9, class];
    let values: Vec<f32> = [0.0, 1.0, 2.0, 3.0].into_iter().flat_map(row).collect();
    let found = decode(&rows, &[("rows", &[1, 4, 6], &values)], 0.5).unwrap();
    assert_eq!(found.per_view[0].len(), 1);
}

#[test]
fn the_scores_after_the_first_belong_to_postures() {
    let head = head("head = 'boxes_scores'\npostures = ['lying', 'low']");
    let outputs: [(&str, &[usize], &[f32]); 2] = [
        ("boxes", &[1, 1, 4], &INSIDE),
        ("scores", &[1, 1, 3], &[0.8, 0.7, 0.6]),
    ];
    let found = decode(&head, &outputs, 0.5).unwrap();
    let found: Vec<_> = found.per_view[0]
        .iter()
        .map(|found| found.posture)
        .collect();
    assert_eq!(found, [None, Some(Posture::Lying), Some(Posture::Low)]);
}

#[test]
fn a_table_without_rows_is_an_empty_view() {
    let rows = head("head = 'end_to_end'\nperson_class = 0");
    let found = decode(&rows, &[("rows", &[1, 0, 6], &[])], 0.5).unwrap();
    assert_eq!(found.per_view, [vec![]]);
}

#[test]
fn the_best_boxes_of_a_view_are_kept() {
    let found = (0..50).map(|index| ViewDetection {
        bbox: BBox::new([0.0, 0.0, 10.0, 10.0]).unwrap(),
        score: f64::from(index * 7 % 50) / 50.0,
        posture: None,
    });
    let mut output = HeadOutput {
        per_view: vec![found.collect()],
        non_finite: 0,
    };
    output.keep_best(10);
    let found = &output.per_view[0];
    assert_eq!(found.len(), 10);
    assert!(found.iter().all(|detection| detection.score > 0.79));
}

//! Counts calculated by hand.

use lookdown_detect::detection::{BBox, FramePixels};

use super::{CalibrationError, Counts};
use crate::{EvaluatedImage, GroundTruth, ScoredBox};

fn bbox(left: f64) -> BBox<FramePixels> {
    BBox::new([left, 0.0, left + 5.0, 5.0]).unwrap()
}

/// An image with persons at some positions, and detections `(position, score)`.
fn image(persons: &[f64], found: &[(f64, f64)]) -> EvaluatedImage<BBox<FramePixels>> {
    let found = found.iter().map(|&(left, score)| ScoredBox {
        bbox: bbox(left),
        score,
    });
    EvaluatedImage {
        truth: GroundTruth {
            persons: persons.iter().map(|&left| bbox(left).into()).collect(),
            ignore_regions: vec![bbox(90.0)],
        },
        detections: found.collect(),
    }
}

fn counts() -> Counts {
    let images = [
        // Two right, one wrong, one ignored, one person missed.
        image(
            &[0.0, 10.0, 20.0],
            &[(0.0, 0.9), (10.0, 0.4), (50.0, 0.35), (90.0, 0.8)],
        ),
        image(&[], &[(50.0, 0.5)]),
        image(&[], &[(50.0, 0.2)]),
    ];
    Counts::from_images(&images)
}

#[test]
fn counts_at_a_threshold_match_a_calculation_by_hand() {
    let figures = counts().at(0.3);
    assert_eq!(figures.false_persons, 2.0 / 3.0);
    assert_eq!(figures.missed_persons, 1.0 / 3.0);
    // The first image has three detections of three persons.
    assert_eq!(figures.count_error, 1.0 / 3.0);
    assert_eq!(figures.false_in_empty_images, Some(0.5));
}

#[test]
fn a_false_person_and_a_missed_one_cancel_in_the_number() {
    let images = [image(&[0.0], &[(50.0, 0.9)])];
    let figures = Counts::from_images(&images).at(0.3);
    assert_eq!((figures.false_persons, figures.missed_persons), (1.0, 1.0));
    assert_eq!(figures.count_error, 0.0);
    assert_eq!(figures.false_in_empty_images, None);
}

#[test]
fn the_best_threshold_is_the_nearest_of_equal_ones() {
    let images = [image(&[0.0], &[(0.0, 0.9), (50.0, 0.5)])];
    let best = Counts::from_images(&images).best();
    assert_eq!((best.score_threshold, best.count_error), (0.51, 0.0));
    let images = [image(&[0.0], &[(0.0, 0.9)])];
    let best = Counts::from_images(&images).best();
    assert_eq!(best.score_threshold, 0.3);
}

#[test]
fn calibration_error_compares_scores_with_shares() {
    // The bin of 0.8 has one right of two, that of 0.2 none of one; 0.04 is below the floor.
    let images = [image(
        &[0.0],
        &[(0.0, 0.8), (50.0, 0.8), (60.0, 0.2), (70.0, 0.04)],
    )];
    let counts = Counts::from_images(&images);
    let CalibrationError { error, by_chance } = counts.calibration_error().unwrap();
    assert!((error - (0.6 + 0.2) / 3.0).abs() < 1e-12, "{error}");
    let half_normal = |variance: f64| (2.0 * variance / std::f64::consts::PI).sqrt();
    let expected = (half_normal(0.32) + half_normal(0.16)) / 3.0;
    assert!((by_chance - expected).abs() < 1e-12, "{by_chance}");
    let none = Counts::from_images(&[image(&[0.0], &[])]);
    assert_eq!(none.calibration_error(), None);
}

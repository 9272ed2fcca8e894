//! Small curves with results calculated by hand, and bounds for all others.

use std::num::NonZeroUsize;

use proptest::prelude::*;

use super::PrecisionRecallCurve;
use crate::AveragePrecision;

fn curve(detections: &[(f64, bool)], persons: usize) -> PrecisionRecallCurve {
    PrecisionRecallCurve::from_detections(detections.to_vec(), NonZeroUsize::new(persons).unwrap())
}

fn assert_close(actual: f64, expected: f64) {
    assert!(
        (actual - expected).abs() < 1e-12,
        "{actual} is not {expected}"
    );
}

#[test]
fn perfect_detections_have_average_precision_1() {
    let ap = curve(&[(0.9, true), (0.8, true), (0.7, true)], 3).average_precision();
    assert_close(ap.all_point_area, 1.0);
    assert_close(ap.eleven_point, 1.0);
    assert_close(ap.coco_101_point, 1.0);
}

#[test]
fn no_detections_give_average_precision_0_and_no_best_f1() {
    let curve = curve(&[], 4);
    assert_eq!(curve.average_precision(), AveragePrecision::default());
    assert_eq!(curve.best_f1(), None);
    assert_close(curve.final_recall(), 0.0);
}

#[test]
fn the_three_definitions_match_a_calculation_by_hand() {
    // Envelope: precision 1 up to recall 1/2, then 2/3 up to 1.
    let ap = curve(&[(0.9, true), (0.8, false), (0.7, true)], 2).average_precision();
    assert_close(ap.all_point_area, 0.5 + 0.5 * 2.0 / 3.0);
    assert_close(ap.eleven_point, (6.0 + 5.0 * 2.0 / 3.0) / 11.0);
    assert_close(ap.coco_101_point, (51.0 + 50.0 * 2.0 / 3.0) / 101.0);
}

#[test]
fn a_recall_of_three_tenths_reaches_the_level_of_three_tenths() {
    // 3 × 0.1 is more than 3 ÷ 10 in binary.
    let right: Vec<_> = (0..3).map(|_| (0.9, true)).collect();
    assert_close(
        curve(&right, 10).average_precision().eleven_point,
        4.0 / 11.0,
    );
}

#[test]
fn the_coco_levels_are_those_of_pycocotools_to_the_last_bit() {
    // Its level 35 × 0.01 is more than the recall 35 ÷ 100 in binary.
    let right: Vec<_> = (0..35).map(|_| (0.9, true)).collect();
    let ap = curve(&right, 100).average_precision();
    assert_close(ap.coco_101_point, 35.0 / 101.0);
}

#[test]
fn best_f1_is_the_point_before_the_false_positives() {
    let best = curve(&[(0.9, true), (0.8, true), (0.7, false), (0.6, false)], 3)
        .best_f1()
        .unwrap();
    assert_close(best.score, 0.8);
    assert_close(best.precision, 1.0);
    assert_close(best.recall, 2.0 / 3.0);
    assert_close(best.f1, 0.8);
}

#[test]
fn best_f1_does_not_separate_equal_scores() {
    let best = curve(&[(0.9, true), (0.9, false)], 1).best_f1().unwrap();
    assert_close(best.precision, 0.5);
}

proptest! {
    #[test]
    fn every_number_of_a_curve_is_between_0_and_1(
        outcomes in prop::collection::vec((0.0..1.0, any::<bool>()), 0..50),
        missed in 0..10_usize,
    ) {
        let right = outcomes.iter().filter(|outcome| outcome.1).count();
        let curve = curve(&outcomes, (right + missed).max(1));
        let ap = curve.average_precision();
        let from_points = curve.points.iter().flat_map(|point| [point.precision, point.recall, point.f1]);
        let all = from_points.chain([ap.all_point_area, ap.eleven_point, ap.coco_101_point]);
        for value in all {
            prop_assert!((0.0..=1.0 + 1e-12).contains(&value), "{}", value);
        }
        prop_assert!(curve.points.is_sorted_by(|a, b| a.recall <= b.recall));
    }

    #[test]
    fn a_false_positive_of_lowest_score_changes_nothing(
        outcomes in prop::collection::vec((0.1..1.0, any::<bool>()), 1..50),
    ) {
        let persons = outcomes.len();
        let before = curve(&outcomes, persons).average_precision();
        let mut more = outcomes;
        more.push((0.05, false));
        prop_assert_eq!(curve(&more, persons).average_precision(), before);
    }
}

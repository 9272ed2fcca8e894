//! Tests of the comparison of shapes.

use lookdown_lens::geometry::Pixel;
use nalgebra::Vector2;

use super::*;
use crate::{
    GroundTruth,
    Outcome::{FalsePositive, TruePositive},
    ScoredBox,
    matching::outcomes,
};

fn boxed(corners: [f64; 4]) -> Outline {
    Outline::AxisParallel(BBox::new(corners).unwrap())
}

#[test]
fn only_rotated_truth_is_compared_with_the_oriented_box() {
    let frame = [100, 100];
    let bbox = BBox::new([10.0, 20.0, 50.0, 60.0]).unwrap();
    let oriented_box = OrientedBox {
        center: Pixel::new(30.0, 40.0),
        width: 20.0,
        height: 44.0,
        angle: 0.5,
        up: Vector2::new(0.5_f64.sin(), -0.5_f64.cos()),
    };
    let rotated =
        |numbers, angle| Outline::Rotated(RotatedBox::new(numbers, angle, frame).unwrap());
    assert_eq!(
        Scoring::Rotated.outline(bbox, Some(&oriented_box), frame),
        rotated([30.0, 40.0, 20.0, 44.0], 0.5)
    );
    assert_eq!(
        Scoring::Rotated.outline(bbox, None, frame),
        rotated([30.0, 40.0, 40.0, 40.0], 0.0)
    );
    for scoring in [Scoring::AxisParallel, Scoring::HeadPoint] {
        let outline = scoring.outline(bbox, Some(&oriented_box), frame);
        assert_eq!(outline, Outline::AxisParallel(bbox));
    }
}

#[test]
fn each_box_matches_one_person_whose_head_it_contains() {
    let truth = GroundTruth {
        persons: vec![
            Outline::Head([30.0, 30.0]).into(),
            Outline::Head([35.0, 30.0]).into(),
            Outline::Head([90.0, 90.0]).into(),
        ],
        ignore_regions: Vec::new(),
    };
    let around = |x: f64, score| ScoredBox {
        bbox: boxed([x - 10.0, 20.0, x + 10.0, 60.0]),
        score,
    };
    let detections = [around(32.0, 0.9), around(33.0, 0.8), around(32.5, 0.7)];
    let outcomes = outcomes(&detections, &truth, 0.75);
    assert_eq!(outcomes, [TruePositive, TruePositive, FalsePositive]);
}

//! Equal scores, and both ends of the IoU threshold.

use crate::detection::{BBox, Candidate, Refinement, RefinementParameters, refine};

fn row(x_min: f64, x_max: f64, score: f64) -> Candidate {
    Candidate {
        bbox: BBox::new([x_min, 0.0, x_max, 10.0]).unwrap(),
        score,
        view: 0,
        coordinate_weight: 1.0,
        expected_views: 1.0,
    }
}

fn picked(refinement: Refinement, iou_threshold: f64, candidates: &[Candidate]) -> Vec<usize> {
    let parameters = RefinementParameters {
        refinement,
        iou_threshold,
        sigma: 0.3,
        score_threshold: 0.0,
        max_detections: 100,
    };
    refine(candidates, &parameters)
        .iter()
        .map(|detection| detection.members[0])
        .collect()
}

#[test]
fn the_lower_index_wins_ties_also_after_rescoring() {
    let apart = row(100.0, 110.0, 0.45);
    let best = row(0.0, 10.0, 1.0);
    // Overlaps the best box by one half, so 0.9 becomes 0.45.
    let half = row(0.0, 5.0, 0.9);
    let linear = |candidates: [Candidate; 3]| picked(Refinement::SoftNmsLinear, 0.5, &candidates);
    assert_eq!(linear([apart, best, half]), [1, 0, 2]);
    assert_eq!(linear([half, best, apart]), [1, 0, 2]);
}

#[test]
fn threshold_0_leaves_hard_nms_one_box_but_not_soft_nms() {
    let candidates = [
        row(0.0, 10.0, 0.9),
        row(0.0, 10.0, 0.8),
        row(5.0, 15.0, 0.7),
        row(50.0, 60.0, 0.6),
    ];
    assert_eq!(picked(Refinement::Nms, 0.0, &candidates), [0]);
    assert_eq!(
        picked(Refinement::SoftNmsLinear, 0.0, &candidates),
        [0, 3, 2]
    );
}

#[test]
fn at_threshold_1_only_coinciding_boxes_are_suppressed() {
    let candidates = [
        row(0.0, 10.0, 0.9),
        row(0.0, 10.0, 0.8),
        row(0.0, 9.99, 0.7),
    ];
    assert_eq!(picked(Refinement::Nms, 1.0, &candidates), [0, 2]);
    assert_eq!(picked(Refinement::SoftNmsLinear, 1.0, &candidates), [0, 2]);
}

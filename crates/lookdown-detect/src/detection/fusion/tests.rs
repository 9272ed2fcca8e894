//! Clustering of candidates, and scores from the agreement of views.

use crate::detection::{
    BBox, Candidate, MergedDetection, Refinement, RefinementParameters, refine,
};

const PERSON: [f64; 4] = [100.0, 100.0, 150.0, 200.0];
const SHIFTED: [f64; 4] = [110.0, 100.0, 160.0, 200.0];

fn candidate(corners: [f64; 4], score: f64, view: usize) -> Candidate {
    Candidate {
        bbox: BBox::new(corners).unwrap(),
        score,
        view,
        coordinate_weight: 1.0,
        expected_views: 1.0,
    }
}

fn fuse(candidates: &[Candidate], iou_threshold: f64) -> Vec<MergedDetection> {
    let parameters = RefinementParameters {
        refinement: Refinement::Fusion,
        iou_threshold,
        sigma: 0.3,
        score_threshold: 0.0,
        max_detections: 100,
    };
    refine(candidates, &parameters)
}

fn assert_close(actual: f64, expected: f64) {
    assert!(
        (actual - expected).abs() < 1e-12,
        "{actual} is not {expected}"
    );
}

/// The IoU of a box of the person's width with the same box shifted sideways.
fn iou_when_shifted(pixels: f64) -> f64 {
    (50.0 - pixels) / (50.0 + pixels)
}

#[test]
fn a_fused_box_is_the_mean_weighted_by_cubed_score() {
    let fused = fuse(
        &[candidate(PERSON, 0.8, 0), candidate(SHIFTED, 0.4, 1)],
        0.4,
    );
    assert_eq!(fused.len(), 1);
    assert_close(
        fused[0].bbox.corners()[0],
        (100.0 * 0.512 + 110.0 * 0.064) / 0.576,
    );
    assert_close(fused[0].bbox.corners()[3], 200.0);
    assert_close(fused[0].score, 0.8 * iou_when_shifted(10.0 * 0.064 / 0.576));
    assert_eq!(fused[0].members, [0, 1]);
}

#[test]
fn a_box_cut_off_by_its_view_votes_but_hardly_moves_the_mean() {
    let cut_off = Candidate {
        coordinate_weight: 0.1,
        expected_views: 2.0,
        ..candidate(SHIFTED, 0.8, 1)
    };
    let whole = Candidate {
        expected_views: 2.0,
        ..candidate(PERSON, 0.8, 0)
    };
    let fused = fuse(&[whole, cut_off], 0.4);
    assert_close(fused[0].bbox.corners()[0], (100.0 + 110.0 * 0.1) / 1.1);
    let moved = 1.0 / 1.1;
    let agreement = f64::midpoint(iou_when_shifted(moved), iou_when_shifted(10.0 - moved));
    assert_close(fused[0].score, 0.8 * agreement);
}

#[test]
fn missing_views_vote_zero_up_to_three_expected_views() {
    let lonely = |expected_views| Candidate {
        expected_views,
        ..candidate(PERSON, 0.9, 0)
    };
    assert_close(fuse(&[lonely(1.0)], 0.4)[0].score, 0.9);
    assert_close(fuse(&[lonely(2.0)], 0.4)[0].score, 0.45);
    assert_close(fuse(&[lonely(40.0)], 0.4)[0].score, 0.3);
}

#[test]
fn a_view_that_reports_a_person_twice_votes_once() {
    let expecting_two = |corners, score, view| Candidate {
        expected_views: 2.0,
        ..candidate(corners, score, view)
    };
    let same_view = [
        expecting_two(PERSON, 0.9, 3),
        expecting_two(SHIFTED, 0.8, 3),
    ];
    let two_views = [
        expecting_two(PERSON, 0.9, 3),
        expecting_two(SHIFTED, 0.8, 4),
    ];
    let moved = 10.0 * 0.512 / (0.729 + 0.512);
    let (first, second) = (
        0.9 * iou_when_shifted(moved),
        0.8 * iou_when_shifted(10.0 - moved),
    );
    assert_close(fuse(&same_view, 0.4)[0].score, first / 2.0);
    assert_close(fuse(&two_views, 0.4)[0].score, f64::midpoint(first, second));
}

#[test]
fn more_views_than_expected_do_not_change_a_score() {
    let crowd: Vec<_> = [0.7, 0.6, 0.5, 0.4, 0.3]
        .into_iter()
        .enumerate()
        .map(|(view, score)| candidate(PERSON, score, view))
        .collect();
    assert_close(fuse(&crowd, 0.4)[0].score, 0.7);
}

#[test]
fn expected_views_are_averaged_like_the_coordinates() {
    let expecting = |expected_views, score, view| Candidate {
        expected_views,
        ..candidate(PERSON, score, view)
    };
    // (1 · 0.512 + 3 · 0.064) / 0.576 = 1.22: one vote is required.
    let fused = fuse(&[expecting(1.0, 0.8, 0), expecting(3.0, 0.4, 1)], 0.4);
    assert_close(fused[0].score, 0.8);
    // (3 · 0.512 + 1 · 0.064) / 0.576 = 2.78: three votes are required, one is missing.
    let fused = fuse(&[expecting(3.0, 0.8, 0), expecting(1.0, 0.4, 1)], 0.4);
    assert_close(fused[0].score, 0.4);
}

#[test]
fn a_nested_box_loses_score_and_a_neighboring_box_does_not() {
    let legs = [100.0, 170.0, 150.0, 200.0];
    let beside = [160.0, 100.0, 210.0, 200.0];
    let fused = fuse(
        &[
            candidate(PERSON, 0.9, 0),
            candidate(legs, 0.8, 1),
            candidate(beside, 0.7, 2),
        ],
        0.4,
    );
    let scores: Vec<f64> = fused.iter().map(|detection| detection.score).collect();
    assert_close(scores[0], 0.9);
    assert_close(scores[1], 0.7);
    assert_close(scores[2], 0.4);
}

#[test]
fn boxes_below_the_score_threshold_still_vote() {
    let parameters = RefinementParameters {
        refinement: Refinement::Fusion,
        iou_threshold: 0.4,
        sigma: 0.3,
        score_threshold: 0.3,
        max_detections: 100,
    };
    let expecting_two = |score, view| Candidate {
        expected_views: 2.0,
        ..candidate(PERSON, score, view)
    };
    let fused = refine(
        &[expecting_two(0.55, 0), expecting_two(0.1, 1)],
        &parameters,
    );
    assert_eq!(fused.len(), 1);
    assert_close(fused[0].score, 0.325);
}

#[test]
fn a_candidate_joins_the_cluster_it_overlaps_most() {
    let left = candidate([0.0, 0.0, 10.0, 10.0], 0.9, 0);
    let right = candidate([4.0, 0.0, 14.0, 10.0], 0.8, 1);
    let nearer_right = candidate([3.0, 0.0, 13.0, 10.0], 0.7, 2);
    let fused = fuse(&[left, right, nearer_right], 0.45);
    assert_eq!(fused[0].members, [0]);
    assert_eq!(fused[1].members, [1, 2]);
}

#[test]
fn disjoint_boxes_are_never_fused_even_at_threshold_zero() {
    let apart = [
        candidate([0.0, 0.0, 10.0, 10.0], 0.9, 0),
        candidate([20.0, 0.0, 30.0, 10.0], 0.8, 1),
    ];
    assert_eq!(fuse(&apart, 0.0).len(), 2);
}

#[test]
fn tiny_scores_still_average_to_a_box() {
    let tiny = f64::MIN_POSITIVE;
    let fused = fuse(
        &[candidate(PERSON, tiny, 0), candidate(SHIFTED, tiny, 1)],
        0.4,
    );
    assert_close(fused[0].bbox.corners()[0], 105.0);
}

#[test]
fn disagreement_can_reorder_persons() {
    let doubted = Candidate {
        expected_views: 9.0,
        ..candidate(PERSON, 0.9, 0)
    };
    let agreed = candidate([500.0, 100.0, 550.0, 200.0], 0.5, 1);
    let fused = fuse(&[doubted, agreed], 0.4);
    assert_eq!(fused[0].members, [1]);
    assert_eq!(fused[1].members, [0]);
}

#[test]
fn equal_overlap_joins_the_older_cluster() {
    let left = candidate([0.0, 0.0, 10.0, 10.0], 0.71, 0);
    let right = candidate([4.0, 0.0, 14.0, 10.0], 0.9, 1);
    let between = candidate([2.0, 0.0, 12.0, 10.0], 0.7, 2);
    let fused = fuse(&[left, right, between], 0.45);
    assert_eq!(fused[0].members, [1, 2]);
    assert_eq!(fused[1].members, [0]);
}

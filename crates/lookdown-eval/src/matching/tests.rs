//! Tests of several detections for one person.

use lookdown_detect::detection::{BBox, FramePixels};

use super::{
    GroundTruth,
    Outcome::{self, FalsePositive, Ignored, TruePositive},
    ScoredBox, outcomes,
};
use crate::AnnotatedPerson;

type FrameBox = BBox<FramePixels>;

fn row(x_min: f64, x_max: f64) -> FrameBox {
    BBox::new([x_min, 0.0, x_max, 10.0]).unwrap()
}

fn truth(persons: &[FrameBox], ignore_regions: &[FrameBox]) -> GroundTruth<FrameBox> {
    GroundTruth {
        persons: persons.iter().copied().map(AnnotatedPerson::from).collect(),
        ignore_regions: ignore_regions.to_vec(),
    }
}

fn matched(detections: &[(FrameBox, f64)], truth: &GroundTruth<FrameBox>) -> Vec<Outcome> {
    let detections: Vec<_> = detections
        .iter()
        .map(|(bbox, score)| ScoredBox {
            bbox: *bbox,
            score: *score,
        })
        .collect();
    outcomes(&detections, truth, 0.5)
}

#[test]
fn the_second_detection_of_a_person_is_wrong() {
    let truth = truth(&[row(0.0, 10.0)], &[]);
    let detections = [(row(0.0, 10.0), 0.4), (row(1.0, 10.0), 0.9)];
    assert_eq!(matched(&detections, &truth), [FalsePositive, TruePositive]);
}

#[test]
fn equal_scores_make_the_earlier_detection_right() {
    let truth = truth(&[row(0.0, 10.0)], &[]);
    let detections = [(row(2.0, 10.0), 0.5), (row(0.0, 10.0), 0.5)];
    assert_eq!(matched(&detections, &truth), [TruePositive, FalsePositive]);
}

#[test]
fn a_duplicate_matches_the_next_person() {
    let truth = truth(&[row(0.0, 10.0), row(3.0, 13.0)], &[]);
    // Both overlap the first person most, and the second person sufficiently.
    let detections = [(row(0.0, 10.0), 0.9), (row(1.0, 11.0), 0.8)];
    assert_eq!(matched(&detections, &truth), [TruePositive, TruePositive]);
}

#[test]
fn an_overlap_of_exactly_the_threshold_is_a_match() {
    let truth = truth(&[row(0.0, 10.0)], &[]);
    assert_eq!(matched(&[(row(0.0, 5.0), 0.9)], &truth), [TruePositive]);
}

#[test]
fn any_number_of_detections_may_lie_in_an_ignore_region() {
    let truth = truth(&[], &[row(100.0, 200.0)]);
    let detections = [
        (row(100.0, 110.0), 0.9),
        (row(195.0, 205.0), 0.8),
        (row(196.0, 206.0), 0.7),
    ];
    assert_eq!(
        matched(&detections, &truth),
        [Ignored, Ignored, FalsePositive]
    );
}

#[test]
fn a_person_in_an_ignore_region_is_still_found() {
    let truth = truth(&[row(0.0, 10.0)], &[row(0.0, 100.0)]);
    assert_eq!(matched(&[(row(0.0, 10.0), 0.9)], &truth), [TruePositive]);
}

#[test]
fn duplicates_in_ignore_regions_are_ignored() {
    let truth = truth(&[row(0.0, 10.0)], &[row(0.0, 100.0)]);
    let detections = [(row(0.0, 10.0), 0.9), (row(0.0, 10.0), 0.8)];
    assert_eq!(matched(&detections, &truth), [TruePositive, Ignored]);
}

#[test]
fn equal_overlaps_match_the_last_person() {
    let (first, last) = (row(0.0, 10.0), row(4.0, 14.0));
    let truth = truth(&[first, last], &[]);
    let detections = [(row(2.0, 12.0), 0.9), (last, 0.8)];
    assert_eq!(matched(&detections, &truth), [TruePositive, FalsePositive]);
}

#[test]
fn a_threshold_of_1_tolerates_rounding() {
    let truth = truth(&[row(0.0, 10.0)], &[]);
    let nearly = [ScoredBox {
        bbox: row(0.0, 10.0 - 5e-10),
        score: 0.9,
    }];
    assert_eq!(outcomes(&nearly, &truth, 1.0), [TruePositive]);
}

fn uncounted(outline: FrameBox) -> AnnotatedPerson<FrameBox> {
    AnnotatedPerson {
        counts: false,
        ..AnnotatedPerson::from(outline)
    }
}

#[test]
fn detections_of_uncounted_persons_are_ignored() {
    let mut truth = truth(&[], &[]);
    truth.persons.push(uncounted(row(0.0, 10.0)));
    let twice = [(row(0.0, 10.0), 0.9), (row(1.0, 10.0), 0.8)];
    // Each person, counting or not, matches one detection.
    assert_eq!(matched(&twice, &truth), [Ignored, FalsePositive]);
}

#[test]
fn counted_persons_are_preferred_to_nearer_uncounted_ones() {
    let mut truth = truth(&[row(2.0, 12.0)], &[]);
    truth.persons.push(uncounted(row(0.0, 10.0)));
    let between = [(row(0.0, 10.0), 0.9)];
    assert_eq!(matched(&between, &truth), [TruePositive]);
}

//! Known answers for hard NMS and both Soft-NMS variants.
//!
//! `fixtures/pipeline_nms.json` comes from an independent Python implementation that was itself
//! compared with `OpenCV`'s Soft-NMS: see `fixtures/make_detection_vectors.py`.

use lookdown_detect::detection::{BBox, Candidate, Refinement, RefinementParameters, refine};
use serde::Deserialize;

const TOLERANCE: f64 = 1e-12;

#[derive(Deserialize)]
struct Fixture {
    boxes: Vec<[f64; 4]>,
    scores: Vec<f64>,
    iou: Vec<Vec<f64>>,
    results: Vec<Answer>,
}

#[derive(Deserialize)]
struct Answer {
    method: String,
    #[serde(rename = "N_t")]
    iou_threshold: Option<f64>,
    sigma: Option<f64>,
    #[serde(rename = "C_t")]
    score_threshold: f64,
    kept: Vec<Kept>,
}

#[derive(Deserialize)]
struct Kept {
    index: usize,
    score: f64,
}

impl Answer {
    /// The fixture omits the parameter that a method does not use. Any value works for it.
    fn parameters(&self) -> RefinementParameters {
        RefinementParameters {
            refinement: match self.method.as_str() {
                "hard" => Refinement::Nms,
                "linear" => Refinement::SoftNmsLinear,
                "gaussian" => Refinement::SoftNmsGaussian,
                other => panic!("the fixture names an unknown method {other}"),
            },
            iou_threshold: self.iou_threshold.unwrap_or(0.5),
            sigma: self.sigma.unwrap_or(0.5),
            score_threshold: self.score_threshold,
            max_detections: usize::MAX,
        }
    }
}

fn fixture() -> Fixture {
    serde_json::from_str(include_str!("../fixtures/pipeline_nms.json")).unwrap()
}

fn candidates(fixture: &Fixture) -> Vec<Candidate> {
    fixture
        .boxes
        .iter()
        .zip(&fixture.scores)
        .map(|(corners, score)| Candidate {
            bbox: BBox::new(*corners).unwrap(),
            score: *score,
            view: 0,
            coordinate_weight: 1.0,
            expected_views: 1.0,
        })
        .collect()
}

#[test]
fn every_iou_equals_the_known_value() {
    let fixture = fixture();
    let candidates = candidates(&fixture);
    for (a, row) in candidates.iter().zip(&fixture.iou) {
        for (b, known) in candidates.iter().zip(row) {
            assert!((a.bbox.iou(&b.bbox) - known).abs() < TOLERANCE);
        }
    }
}

#[test]
fn the_nms_family_keeps_the_known_boxes_with_the_known_scores() {
    let fixture = fixture();
    let candidates = candidates(&fixture);
    assert_eq!(fixture.results.len(), 45);
    for answer in &fixture.results {
        let parameters = answer.parameters();
        let kept = refine(&candidates, &parameters);
        let indices: Vec<usize> = kept.iter().map(|detection| detection.members[0]).collect();
        let known: Vec<usize> = answer.kept.iter().map(|kept| kept.index).collect();
        assert_eq!(indices, known, "{parameters:?}");
        for (detection, known) in kept.iter().zip(&answer.kept) {
            assert!(
                (detection.score - known.score).abs() < TOLERANCE,
                "{parameters:?}"
            );
            assert_eq!(detection.bbox, candidates[known.index].bbox);
        }
    }
}

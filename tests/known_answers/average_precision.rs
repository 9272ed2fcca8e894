//! Known answers for matching, precision and recall, and average precision.
//!
//! `fixtures/pipeline_ap.json` comes from an independent Python implementation, itself compared
//! with `pycocotools`. `fixtures/average_precision_with_ignore_regions.json` holds the results of
//! `pycocotools`. See `fixtures/make_detection_vectors.py`.

use std::collections::BTreeMap;

use lookdown_detect::detection::{BBox, FramePixels};
use lookdown_eval::{
    AnnotatedPerson, EvaluatedImage, GroundTruth, PrecisionRecallCurve, ScoredBox, Summary,
};
use serde::Deserialize;

const TOLERANCE: f64 = 1e-12;

type Corners = [f64; 4];
type BoxesByImage = BTreeMap<usize, Vec<Corners>>;

#[derive(Deserialize)]
struct Found {
    image: usize,
    score: f64,
    #[serde(rename = "box")]
    corners: Corners,
}

#[derive(Deserialize)]
struct Fixture {
    gt: BoxesByImage,
    detections: Vec<Found>,
    n_gt: usize,
    results: BTreeMap<String, Answer>,
    pycocotools_check: CocoAnswer,
}

#[derive(Deserialize)]
struct Answer {
    voc07_11pt: f64,
    voc10_area: f64,
    coco_101: f64,
    order: Vec<usize>,
    recall: Vec<f64>,
    precision: Vec<f64>,
}

#[derive(Deserialize)]
struct IgnoreFixture {
    persons: BoxesByImage,
    ignore_regions: BoxesByImage,
    detections: Vec<Found>,
    pycocotools: CocoAnswer,
}

#[derive(Deserialize)]
#[serde(rename_all = "UPPERCASE")]
struct CocoAnswer {
    ap50: f64,
    ap75: f64,
    ap50_95: f64,
}

fn frame_box(corners: &Corners) -> BBox<FramePixels> {
    BBox::new(*corners).unwrap()
}

fn images(
    persons: &BoxesByImage,
    ignore_regions: &BoxesByImage,
    detections: &[Found],
) -> Vec<EvaluatedImage<BBox<FramePixels>>> {
    let boxes_of = |boxes: &BoxesByImage, image: &usize| -> Vec<_> {
        boxes
            .get(image)
            .into_iter()
            .flatten()
            .map(frame_box)
            .collect()
    };
    persons
        .keys()
        .map(|image| EvaluatedImage {
            truth: GroundTruth {
                persons: boxes_of(persons, image)
                    .into_iter()
                    .map(AnnotatedPerson::from)
                    .collect(),
                ignore_regions: boxes_of(ignore_regions, image),
            },
            detections: detections
                .iter()
                .filter(|found| found.image == *image)
                .map(|found| ScoredBox {
                    bbox: frame_box(&found.corners),
                    score: found.score,
                })
                .collect(),
        })
        .collect()
}

fn assert_close(actual: f64, known: f64, what: &str) {
    assert!(
        (actual - known).abs() < TOLERANCE,
        "{what}: {actual} is not {known}"
    );
}

#[test]
fn curves_and_average_precisions_match_known_answers() {
    let fixture: Fixture =
        serde_json::from_str(include_str!("../fixtures/pipeline_ap.json")).unwrap();
    let images = images(&fixture.gt, &BTreeMap::new(), &fixture.detections);
    for (name, min_iou) in [("coco_matching_Ot0.5", 0.5), ("coco_matching_Ot0.75", 0.75)] {
        let known = &fixture.results[name];
        let curve = PrecisionRecallCurve::from_images(&images, min_iou).unwrap();
        assert_eq!(curve.points.len(), known.order.len());
        for (rank, point) in curve.points.iter().enumerate() {
            let score = fixture.detections[known.order[rank]].score;
            assert_close(point.score, score, name);
            assert_close(point.recall, known.recall[rank], name);
            assert_close(point.precision, known.precision[rank], name);
        }
        let ap = curve.average_precision();
        assert_close(ap.eleven_point, known.voc07_11pt, name);
        assert_close(ap.all_point_area, known.voc10_area, name);
        assert_close(ap.coco_101_point, known.coco_101, name);
    }
}

#[test]
fn the_summary_agrees_with_pycocotools() {
    let fixture: Fixture =
        serde_json::from_str(include_str!("../fixtures/pipeline_ap.json")).unwrap();
    let images = images(&fixture.gt, &BTreeMap::new(), &fixture.detections);
    let summary = Summary::from_images(&images).unwrap();
    assert_eq!((summary.images, summary.persons), (8, fixture.n_gt));
    assert_agrees(&summary, &fixture.pycocotools_check);
}

#[test]
fn ignore_regions_and_equal_scores_count_as_in_pycocotools() {
    let fixture: IgnoreFixture = serde_json::from_str(include_str!(
        "../fixtures/average_precision_with_ignore_regions.json"
    ))
    .unwrap();
    let images = images(
        &fixture.persons,
        &fixture.ignore_regions,
        &fixture.detections,
    );
    let summary = Summary::from_images(&images).unwrap();
    assert_agrees(&summary, &fixture.pycocotools);
}

fn assert_agrees(summary: &Summary, known: &CocoAnswer) {
    assert_close(summary.ap50.coco_101_point, known.ap50, "AP50");
    assert_close(summary.ap75.coco_101_point, known.ap75, "AP75");
    assert_close(summary.ap50_95.coco_101_point, known.ap50_95, "AP50:95");
}

#[test]
fn a_data_set_without_persons_has_no_summary() {
    let empty = images(&BTreeMap::from([(0, Vec::new())]), &BTreeMap::new(), &[]);
    assert!(Summary::from_images(&empty).is_err());
}

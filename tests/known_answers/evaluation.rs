//! Known answers for rotated boxes and for the figures by stratum, from masks tested pixel by pixel
//! and from `pycocotools`: see `fixtures/make_evaluation_vectors.py`.

use std::{collections::BTreeMap, path::PathBuf};

use lookdown_detect::detection::BBox;
use lookdown_eval::{
    AnnotatedPerson, DataSetImage, EvaluatedImage, GroundTruth, ImageId, Outline, Region,
    RotatedBox, ScoredBox, Stratification, Summary,
};
use serde::Deserialize;

const TOLERANCE: f64 = 1e-12;
/// The tolerance between pixel masks and exact polygons, and the polygons as `pycocotools` draws
/// them: boxes are at least 15 pixels wide.
const RASTER_TOLERANCE: f64 = 0.02;

#[track_caller]
fn assert_within(tolerance: f64, actual: f64, known: f64, what: &str) {
    assert!(
        (actual - known).abs() < tolerance,
        "{what}: {actual} is not {known}"
    );
}

fn rotated([cx, cy, width, height, degrees]: [f64; 5], frame: [u32; 2]) -> RotatedBox {
    RotatedBox::new([cx, cy, width, height], degrees.to_radians(), frame).unwrap()
}

#[derive(Deserialize)]
struct RotatedBoxes {
    frame: [u32; 2],
    pairs: Vec<Pair>,
}

#[derive(Deserialize)]
struct Pair {
    a: [f64; 5],
    b: [f64; 5],
    area_a: f64,
    area_b: f64,
    intersection: f64,
    exact_iou: f64,
    pycocotools_iou: f64,
    ellipse_bounds_a: [f64; 4],
}

fn rotated_boxes() -> RotatedBoxes {
    serde_json::from_str(include_str!("../fixtures/rotated_boxes.json")).unwrap()
}

#[test]
fn rotated_boxes_overlap_by_shared_pixel_centers() {
    let RotatedBoxes { frame, pairs } = rotated_boxes();
    assert_eq!(pairs.len(), 150);
    for pair in pairs {
        let (a, b) = (rotated(pair.a, frame), rotated(pair.b, frame));
        let union = pair.area_a + pair.area_b - pair.intersection;
        assert_within(TOLERANCE, a.iou(&b), pair.intersection / union, "IoU");
        let share = pair.intersection / pair.area_a;
        assert_within(TOLERANCE, a.share_in(&b), share, "share");
    }
}

#[test]
fn overlaps_of_rotated_boxes_agree_with_exact_polygons() {
    let RotatedBoxes { frame, pairs } = rotated_boxes();
    for pair in pairs {
        let iou = rotated(pair.a, frame).iou(&rotated(pair.b, frame));
        assert_within(RASTER_TOLERANCE, iou, pair.exact_iou, "exact");
        assert_within(RASTER_TOLERANCE, iou, pair.pycocotools_iou, "pycocotools");
    }
}

#[test]
fn rotated_boxes_convert_to_bounds_of_their_ellipses() {
    let RotatedBoxes { frame, pairs } = rotated_boxes();
    for pair in pairs {
        let bounds = rotated(pair.a, frame).inscribed_ellipse_bounds().unwrap();
        for (actual, sampled) in bounds.corners().into_iter().zip(pair.ellipse_bounds_a) {
            assert_within(1e-6, actual, sampled, "edge");
        }
    }
}

#[derive(Deserialize)]
struct RotatedSet {
    frame: [u32; 2],
    persons: BTreeMap<usize, Vec<[f64; 5]>>,
    ignore_regions: BTreeMap<usize, Vec<[f64; 5]>>,
    detections: Vec<FoundRotated>,
    pycocotools: CocoAnswer,
}

#[derive(Deserialize)]
struct FoundRotated {
    image: usize,
    score: f64,
    #[serde(rename = "box")]
    rotated: [f64; 5],
}

#[derive(Deserialize)]
#[serde(rename_all = "UPPERCASE")]
struct CocoAnswer {
    ap50: f64,
    ap75: f64,
    ap50_95: f64,
}

#[test]
fn average_precision_of_rotated_boxes_agrees_with_pycocotools() {
    let text = include_str!("../fixtures/rotated_average_precision.json");
    let fixture: RotatedSet = serde_json::from_str(text).unwrap();
    let outline = |numbers: &[f64; 5]| Outline::Rotated(rotated(*numbers, fixture.frame));
    let images = fixture.persons.iter().map(|(image, persons)| {
        let detections = fixture
            .detections
            .iter()
            .filter(|found| found.image == *image);
        EvaluatedImage {
            truth: GroundTruth {
                persons: persons.iter().map(|b| outline(b).into()).collect(),
                ignore_regions: fixture.ignore_regions[image].iter().map(outline).collect(),
            },
            detections: detections
                .map(|found| ScoredBox {
                    bbox: outline(&found.rotated),
                    score: found.score,
                })
                .collect(),
        }
    });
    let images: Vec<_> = images.collect();
    let summary = Summary::from_images(&images).unwrap();
    let known = &fixture.pycocotools;
    let ap = |ap: lookdown_eval::AveragePrecision| ap.coco_101_point;
    assert_within(TOLERANCE, ap(summary.ap50), known.ap50, "AP50");
    assert_within(TOLERANCE, ap(summary.ap75), known.ap75, "AP75");
    assert_within(TOLERANCE, ap(summary.ap50_95), known.ap50_95, "AP50:95");
}

#[derive(Deserialize)]
struct StrataSet {
    side: u32,
    persons: Vec<Placed>,
    ignore_regions: Vec<Placed>,
    detections: Vec<Placed>,
    distance: Vec<Figures>,
    size: Vec<Figures>,
}

#[derive(Deserialize)]
struct Placed {
    image_id: u64,
    /// Left, top, width, height.
    bbox: [f64; 4],
    #[serde(default)]
    score: f64,
}

#[derive(Deserialize)]
struct Figures {
    persons: usize,
    ap50: f64,
    recall: f64,
}

impl Placed {
    fn outline(&self) -> Outline {
        let [left, top, width, height] = self.bbox;
        Outline::AxisParallel(BBox::new([left, top, left + width, top + height]).unwrap())
    }
}

#[test]
fn strata_agree_with_area_ranges_of_pycocotools() {
    let fixture: StrataSet = serde_json::from_str(include_str!("../fixtures/strata.json")).unwrap();
    let of_image = |all: &[Placed], id: u64| -> Vec<Outline> {
        let here = all.iter().filter(|placed| placed.image_id == id);
        here.map(Placed::outline).collect()
    };
    let images: Vec<(DataSetImage, EvaluatedImage<Outline>)> = (0..25)
        .map(|id| {
            let persons = of_image(&fixture.persons, id).into_iter();
            let truth = GroundTruth {
                persons: persons.map(AnnotatedPerson::from).collect(),
                ignore_regions: of_image(&fixture.ignore_regions, id),
            };
            let found = fixture.detections.iter();
            let found = found.filter(|placed| placed.image_id == id);
            let detections = found.map(|placed| ScoredBox {
                bbox: placed.outline(),
                score: placed.score,
            });
            let image = DataSetImage {
                id: ImageId::Number(id),
                path: PathBuf::new(),
                calibration: None,
                size: Some([fixture.side, fixture.side]),
                truth: truth.clone(),
            };
            let detections = detections.collect();
            (image, EvaluatedImage { truth, detections })
        })
        .collect();
    let images: Vec<_> = images.iter().map(|(place, image)| (place, image)).collect();
    for (by, known) in [
        (Stratification::Distance, &fixture.distance),
        (Stratification::Size, &fixture.size),
    ] {
        let strata = by.strata(&images).unwrap();
        assert_eq!(strata.len(), known.len());
        for (stratum, known) in strata.iter().zip(known) {
            assert_eq!(stratum.persons, known.persons, "{}", stratum.name);
            let figures = stratum.figures.unwrap();
            let ap50 = figures.ap50.coco_101_point;
            assert_within(TOLERANCE, ap50, known.ap50, stratum.name);
            assert_within(TOLERANCE, figures.recall, known.recall, stratum.name);
        }
    }
}

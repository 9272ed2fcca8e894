use lookdown_detect::detection::BBox;
use lookdown_eval::{
    EvaluatedImage, FoundPerson, GroundTruth, PrecisionRecallCurve, RowName, ScoredBox, Summary,
};

use super::*;

fn cells_of_paper() -> Vec<DetectParameters> {
    let base =
        DetectParameters::parse([("profile", "paper"), ("score_threshold", "0.01")]).unwrap();
    cells(&base)
}

#[test]
fn the_cells_are_those_of_the_sweeps_in_the_paper() {
    let cells = cells_of_paper();
    let of = |refinement: Refinement| {
        let numbers = cells.iter().map(|cell| cell.refinement);
        numbers.filter(move |numbers| numbers.refinement == refinement)
    };
    for refinement in [Refinement::Nms, Refinement::SoftNmsLinear] {
        let thresholds: Vec<f64> = of(refinement).map(|cell| cell.iou_threshold).collect();
        let expected = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0];
        assert_eq!(thresholds, expected);
        assert!(of(refinement).all(|cell| cell.score_threshold == 0.01));
    }
    let matrix: Vec<_> = of(Refinement::SoftNmsGaussian)
        .map(|cell| (cell.score_threshold, cell.sigma))
        .collect();
    assert_eq!(matrix.len(), 20);
    assert_eq!((matrix[0], matrix[19]), ((0.3, 0.1), (0.8, 0.9)));
    assert_eq!(cells.len(), 42);
}

/// A sweep in which a cell of lower `C_t` has more detections: the first has both persons.
fn swept() -> Vec<(DetectedRow, EvaluatedRow)> {
    let bbox = |left: f64| BBox::new([left, 40.0, left + 20.0, 80.0]).unwrap();
    let found = |left, score| FoundPerson {
        bbox: bbox(left),
        oriented_box: None,
        score,
    };
    let truth = GroundTruth {
        persons: vec![bbox(20.0).into(), bbox(140.0).into()],
        ignore_regions: Vec::new(),
    };
    let row = |parameters: DetectParameters| {
        let numbers = parameters.refinement;
        let all = [found(20.0, 0.9), found(140.0, 0.4)];
        let kept = all
            .iter()
            .filter(|found| found.score >= numbers.score_threshold);
        let kept: Vec<_> = kept.copied().collect();
        let images = [EvaluatedImage {
            truth: truth.clone(),
            detections: kept
                .iter()
                .map(|found| ScoredBox {
                    bbox: found.bbox,
                    score: found.score,
                })
                .collect(),
        }];
        let curve = |iou| PrecisionRecallCurve::from_images(&images, iou).unwrap();
        let evaluated = EvaluatedRow {
            summary: Summary::from_images(&images).unwrap(),
            curve_at_50: curve(0.5),
            curve_at_75: curve(0.75),
        };
        let detected = DetectedRow {
            name: RowName {
                profile: Some(parameters.profile),
                refinement: Some(numbers.refinement),
                model: "tiny".to_owned(),
            },
            refinement: Some(numbers),
            cost: None,
            images: vec![kept],
        };
        (detected, evaluated)
    };
    cells_of_paper().into_iter().map(row).collect()
}

#[test]
fn the_table_has_a_line_per_cell() {
    let table = table(&swept());
    let lines: Vec<_> = table.lines().collect();
    assert_eq!(lines.len(), 43);
    assert_eq!(lines[1], "nms,0.01,0,0.3,2,1,1,1,1,1");
    assert!(
        lines[42].starts_with("soft_nms_gaussian,0.8,0.5,0.9,1,0.5,0.5,"),
        "{}",
        lines[42]
    );
}

#[test]
fn the_plot_has_a_point_per_iou_threshold() {
    let plot = iou_threshold_plot("tiny".to_owned(), &swept());
    let names: Vec<_> = plot.lines.iter().map(|line| line.name.as_str()).collect();
    assert_eq!(names, ["NMS", "Soft-NMS"]);
    for line in &plot.lines {
        assert_eq!((line.points.len(), line.dashed.len()), (11, 11));
        assert_eq!(line.points[3], [0.3, 1.0]);
    }
}

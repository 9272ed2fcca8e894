use super::*;

fn cells_of_paper() -> Vec<DetectParameters> {
    let base = DetectParameters::parse([("profile", "paper")], 0.01).unwrap();
    cells(&base)
}

#[test]
fn the_cells_are_those_of_the_papers_sweeps() {
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

//! The parameter sweeps of the paper (Seidel et al., section IV): AP over N_t, and the detections
//! of Gaussian Soft-NMS over C_t and σ.

use std::fmt::Write;

use lookdown_detect::{
    detection::{Refinement, RefinementParameters},
    parameters::DetectParameters,
};
use lookdown_eval::{DetectedRow, EvaluatedRow};

use crate::plot::{Line, LinePlot};

/// `N_t` from 0 to 1.
const IOU_STEPS: u8 = 10;
/// `C_t` of the matrix.
const SCORE_THRESHOLDS: [f64; 4] = [0.3, 0.5, 0.7, 0.8];
/// σ of the matrix.
const SIGMAS: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];

/// The parameters of all cells: `base` with hard NMS and with linear Soft-NMS at every `N_t`, then
/// with Gaussian Soft-NMS at every `C_t` and σ.
pub fn cells(base: &DetectParameters) -> Vec<DetectParameters> {
    let cell = |refinement: RefinementParameters| DetectParameters {
        refinement,
        ..base.clone()
    };
    let over_iou = [Refinement::Nms, Refinement::SoftNmsLinear]
        .into_iter()
        .flat_map(|refinement| (0..=IOU_STEPS).map(move |step| (refinement, step)))
        .map(|(refinement, step)| {
            cell(RefinementParameters {
                refinement,
                iou_threshold: f64::from(step) / f64::from(IOU_STEPS),
                ..base.refinement
            })
        });
    let of_matrix = SCORE_THRESHOLDS
        .into_iter()
        .flat_map(|score_threshold| SIGMAS.map(|sigma| (score_threshold, sigma)))
        .map(|(score_threshold, sigma)| {
            cell(RefinementParameters {
                refinement: Refinement::SoftNmsGaussian,
                score_threshold,
                sigma,
                ..base.refinement
            })
        });
    over_iou.chain(of_matrix).collect()
}

/// Returns the figures of all cells as comma-separated values with a header.
pub fn table(cells: &[(DetectedRow, EvaluatedRow)]) -> String {
    let mut lines = String::from(
        "refine,score_threshold,iou_threshold,sigma,boxes,ap50,ap75,ap50_95,f1,recall\n",
    );
    for (detected, evaluated) in cells {
        let Some(numbers) = detected.refinement else {
            continue;
        };
        let boxes: usize = detected.images.iter().map(Vec::len).sum();
        let summary = &evaluated.summary;
        // Writing to a string cannot fail.
        let _ = writeln!(
            lines,
            "{},{},{},{},{boxes},{},{},{},{},{}",
            numbers.refinement,
            numbers.score_threshold,
            numbers.iou_threshold,
            numbers.sigma,
            summary.ap50.all_point_area,
            summary.ap75.all_point_area,
            summary.ap50_95.all_point_area,
            summary.f1,
            summary.recall,
        );
    }
    lines
}

/// Plots AP over `N_t`, at `O_t` = 0.5, and dashed at 0.75.
pub fn iou_threshold_plot(title: String, cells: &[(DetectedRow, EvaluatedRow)]) -> LinePlot {
    let line = |refinement: Refinement, name: &str| {
        let along = |ap: fn(&EvaluatedRow) -> f64| {
            let of_refinement = cells.iter().filter_map(|(detected, evaluated)| {
                let numbers = detected.refinement?;
                let point = [numbers.iou_threshold, ap(evaluated)];
                (numbers.refinement == refinement).then_some(point)
            });
            of_refinement.collect()
        };
        Line {
            name: name.to_owned(),
            points: along(|row| row.summary.ap50.all_point_area),
            dashed: along(|row| row.summary.ap75.all_point_area),
            marked: true,
        }
    };
    LinePlot {
        title,
        x_name: "N_t".to_owned(),
        y_name: "AP (IoU ≥ 0.5, dashed 0.75)".to_owned(),
        lines: vec![
            line(Refinement::Nms, "NMS"),
            line(Refinement::SoftNmsLinear, "Soft-NMS"),
        ],
    }
}

#[cfg(test)]
mod tests;

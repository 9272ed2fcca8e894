//! The precision-recall curves of several rows.

use super::{Line, LinePlot};
use crate::evaluation::{EvaluatedRow, PrecisionRecallCurve};

/// Precision over recall of named rows at `O_t` = 0.5, and dashed at 0.75. Precision is the
/// greatest at a recall or beyond: the area under a line is its average precision.
#[must_use]
pub fn precision_recall_plot<'a>(
    title: String,
    rows: impl IntoIterator<Item = (String, &'a EvaluatedRow)>,
) -> LinePlot {
    let lines = rows.into_iter().map(|(name, row)| Line {
        name: format!(
            "{name}   AP {:.3} / {:.3}",
            row.summary.ap50.all_point_area, row.summary.ap75.all_point_area
        ),
        points: steps(&row.curve_at_50),
        dashed: steps(&row.curve_at_75),
        marked: false,
    });
    LinePlot {
        title,
        x_name: "recall".to_owned(),
        y_name: "precision (IoU ≥ 0.5, dashed 0.75)".to_owned(),
        lines: lines.collect(),
    }
}

/// The corners of the envelope, from recall 0 to the last.
fn steps(curve: &PrecisionRecallCurve) -> Vec<[f64; 2]> {
    let mut corners: Vec<[f64; 2]> = Vec::new();
    let mut reached = 0.0;
    for (recall, precision) in curve.envelope() {
        if corners.last().is_none_or(|last| last[1] != precision) {
            corners.push([reached, precision]);
        } else if corners.len() > 1 && corners[corners.len() - 2][1] == precision {
            // Along a level only its ends matter.
            corners.pop();
        }
        corners.push([recall, precision]);
        reached = recall;
    }
    corners
}

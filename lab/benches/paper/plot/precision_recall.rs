//! The precision-recall curves of several rows.

use lookdown_eval::{EvaluatedRow, PrecisionRecallCurve};

use super::{Line, LinePlot};

/// Plots precision over recall of named rows at `O_t` = 0.5, and dashed at 0.75. The precision at a
/// recall is the maximum at that recall or a higher one: the area under a line is its average
/// precision.
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
    let envelope = curve.envelope();
    // The first of the points at one recall is the highest.
    let levels = envelope
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|points| points.first().copied());
    let mut corners: Vec<[f64; 2]> = Vec::new();
    let mut reached = 0.0;
    for (recall, precision) in levels {
        match corners.last_mut() {
            Some(end) if end[1] == precision => end[0] = recall,
            _ => corners.extend([[reached, precision], [recall, precision]]),
        }
        reached = recall;
    }
    corners
}

#[cfg(test)]
mod tests {
    use lookdown_detect::detection::{BBox, FramePixels};

    use lookdown_eval::{EvaluatedImage, GroundTruth, ScoredBox};

    use super::*;

    #[test]
    fn the_area_under_a_line_is_the_average_precision() {
        let bbox = |left: f64| BBox::<FramePixels>::new([left, 0.0, left + 5.0, 5.0]).unwrap();
        let persons = [0.0, 10.0, 20.0, 30.0].map(|left| bbox(left).into());
        // Right, right, wrong, wrong, right, wrong. One person is missed.
        let found = [0.0, 10.0, 50.0, 60.0, 20.0, 70.0]
            .iter()
            .zip([9, 8, 7, 6, 5, 4]);
        let image = EvaluatedImage {
            truth: GroundTruth {
                persons: persons.into(),
                ignore_regions: Vec::new(),
            },
            detections: found
                .map(|(left, score)| ScoredBox {
                    bbox: bbox(*left),
                    score: f64::from(score) / 10.0,
                })
                .collect(),
        };
        let curve = PrecisionRecallCurve::from_images(&[image], 0.5).unwrap();
        let steps = steps(&curve);
        assert_eq!(steps, [[0.0, 1.0], [0.5, 1.0], [0.5, 0.6], [0.75, 0.6]]);
        let area: f64 = steps
            .windows(2)
            .map(|pair| (pair[1][0] - pair[0][0]) * pair[0][1])
            .sum();
        assert!((area - curve.average_precision().all_point_area).abs() < 1e-12);
    }
}

//! The picture of the matrix: one image with what is found in it at each `C_t` and σ.

use super::{SCORE_THRESHOLDS, SIGMAS};
use crate::{
    detection::Refinement,
    evaluation::{DetectedRow, EvaluatedRow, FoundPerson},
    imaging::{
        Frame, FrameError,
        annotate::{Mark, annotate},
        picture_grid::{GridCell, PictureGrid},
        thumbnail,
    },
};

/// Longer side of the image in each cell, pixels.
pub const MATRIX_CELL_SIDE: u32 = 300;

/// The image `frame`, that in `position` of the data set, with the boxes of each cell: rows of
/// `C_t`, columns of σ. Below each cell its boxes are counted, and the AP of the whole data set is
/// told.
///
/// # Errors
/// [`FrameError`] when the picture would be too large.
pub fn matrix(
    title: String,
    cells: &[(DetectedRow, EvaluatedRow)],
    frame: &Frame,
    position: usize,
) -> Result<Frame, FrameError> {
    let small = thumbnail(frame, MATRIX_CELL_SIDE);
    let scale = f64::from(small.width()) / f64::from(frame.width());
    let cell = |score_threshold: f64, sigma: f64| {
        let (detected, evaluated) = cells.iter().find(|(detected, _)| {
            detected.refinement.is_some_and(|numbers| {
                numbers.refinement == Refinement::SoftNmsGaussian
                    && numbers.score_threshold == score_threshold
                    && numbers.sigma == sigma
            })
        })?;
        let found = detected.images.get(position)?;
        let marks: Vec<Mark> = found.iter().map(|person| mark(person, scale)).collect();
        let mut picture = small.clone();
        annotate(&mut picture, &marks);
        let boxes = if found.len() == 1 { "box" } else { "boxes" };
        let ap = evaluated.summary.ap50.all_point_area;
        Some(GridCell {
            picture,
            caption: format!("{} {boxes}, AP {ap:.3}", found.len()),
        })
    };
    let row = |score_threshold: f64| {
        let cells = SIGMAS
            .iter()
            .filter_map(|sigma| cell(score_threshold, *sigma));
        (format!("C_t {score_threshold}"), cells.collect())
    };
    PictureGrid {
        title,
        columns: SIGMAS.map(|sigma| format!("σ {sigma}")).into(),
        rows: SCORE_THRESHOLDS.map(row).into(),
    }
    .drawn()
}

/// The box that is compared with the truth, without its score: cells are small.
fn mark(person: &FoundPerson, scale: f64) -> Mark {
    Mark {
        bbox: person.bbox.corners().map(|side| side * scale),
        oriented: None,
        label: String::new(),
    }
}

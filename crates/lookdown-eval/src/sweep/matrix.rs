//! The image of the matrix: one image with its detections at each `C_t` and σ.

use std::ops::Range;

use lookdown_detect::detection::Refinement;
use lookdown_imaging::{
    Frame, FrameError,
    annotate::{Drawing, Mark, annotate},
    image_grid::{GridCell, ImageGrid},
    thumbnail,
};

use super::{SCORE_THRESHOLDS, SIGMAS};
use crate::{DetectedRow, EvaluatedRow, FoundPerson};

/// Margin around the boxes, as a fraction of the side of the square that contains them.
const ROOM_SHARE: f64 = 0.06;
/// Longer side of the image in each cell, pixels.
const CELL_SIDE: u32 = 300;

/// Draws the part of the image `frame` (at `position` in the data set) that contains boxes, once
/// for each cell: rows of `C_t`, columns of σ. The caption of a cell has its number of boxes, and
/// the AP over the whole data set.
///
/// # Errors
/// [`FrameError`] if the image would be too large.
pub fn matrix(
    title: String,
    cells: &[(DetectedRow, EvaluatedRow)],
    frame: &Frame,
    position: usize,
) -> Result<Frame, FrameError> {
    let boxes = cells.iter().filter(|cell| matrix_scores(cell).is_some());
    let boxes = boxes.filter_map(|(detected, _)| detected.images.get(position));
    let (columns, rows) = part_with(boxes.flatten(), frame);
    let corner = [f64::from(columns.start), f64::from(rows.start)];
    let part = frame.crop(columns, rows)?;
    let small = thumbnail(&part, CELL_SIDE);
    let scale = f64::from(small.width()) / f64::from(part.width());
    let cell = |score_threshold: f64, sigma: f64| {
        let (detected, evaluated) = cells
            .iter()
            .find(|cell| matrix_scores(cell) == Some((score_threshold, sigma)))?;
        let found = detected.images.get(position)?;
        let marks: Vec<Mark> = found
            .iter()
            .map(|person| mark(person, corner, scale))
            .collect();
        let mut image = small.clone();
        annotate(&mut image, &Drawing::new(marks));
        let boxes = if found.len() == 1 { "box" } else { "boxes" };
        let ap = evaluated.summary.ap50.all_point_area;
        Some(GridCell {
            image,
            caption: format!("{} {boxes}, AP {ap:.3}", found.len()),
        })
    };
    let row = |score_threshold: f64| {
        let cells = SIGMAS
            .iter()
            .filter_map(|sigma| cell(score_threshold, *sigma));
        (format!("C_t {score_threshold}"), cells.collect())
    };
    ImageGrid {
        title,
        columns: SIGMAS.map(|sigma| format!("σ {sigma}")).into(),
        rows: SCORE_THRESHOLDS.map(row).into(),
    }
    .drawn()
}

/// `C_t` and σ of a cell of the matrix.
fn matrix_scores((detected, _): &(DetectedRow, EvaluatedRow)) -> Option<(f64, f64)> {
    let numbers = detected.refinement?;
    (numbers.refinement == Refinement::SoftNmsGaussian)
        .then_some((numbers.score_threshold, numbers.sigma))
}

/// Columns and rows of the square around all boxes with a margin. It is the whole frame if there
/// are not boxes.
fn part_with<'a>(
    boxes: impl Iterator<Item = &'a FoundPerson>,
    frame: &Frame,
) -> (Range<u32>, Range<u32>) {
    let corners = boxes.map(|person| person.bbox.corners());
    let hull = corners.reduce(|a, b| {
        [
            a[0].min(b[0]),
            a[1].min(b[1]),
            a[2].max(b[2]),
            a[3].max(b[3]),
        ]
    });
    let Some([x_min, y_min, x_max, y_max]) = hull else {
        return (0..frame.width(), 0..frame.height());
    };
    let side = (x_max - x_min).max(y_max - y_min) * (1.0 + 2.0 * ROOM_SHARE);
    let around = |from: f64, to: f64, length: u32| {
        let length = f64::from(length);
        let start = (f64::midpoint(from, to) - side / 2.0)
            .min(length - side)
            .max(0.0);
        // `as` saturates, and the frame clips what is too long.
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clipped to the frame"
        )]
        {
            start as u32..(start + side).ceil().max(1.0) as u32
        }
    };
    (
        around(x_min, x_max, frame.width()),
        around(y_min, y_max, frame.height()),
    )
}

/// The box that is compared with the truth, without its score: cells are small.
fn mark(person: &FoundPerson, [left, top]: [f64; 2], scale: f64) -> Mark {
    let [x_min, y_min, x_max, y_max] = person.bbox.corners();
    let bbox = [x_min - left, y_min - top, x_max - left, y_max - top];
    Mark {
        bbox: bbox.map(|side| side * scale),
        oriented: None,
        head: None,
        label: String::new(),
    }
}

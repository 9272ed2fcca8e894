//! The dark surround of the lens image, whose outline is not an edge of the room.

use lookdown_lens::saturating::to_usize;

use crate::{frame::Frame, lens_circle::surround_threshold};

/// Side of a cell, in pixels of the divided frame.
const CELL: usize = 4;

/// Cells that are dark and connected with the border of the frame, and their neighbors.
pub(super) struct SurroundMask {
    columns: usize,
    dark: Vec<bool>,
}

impl SurroundMask {
    pub(super) fn contains(&self, [x, y]: [f64; 2]) -> bool {
        let [column, row] = [x, y].map(|at| to_usize(at) / CELL);
        self.dark
            .get(row * self.columns + column)
            .copied()
            .unwrap_or(true)
    }
}

/// Returns the surround of a frame, each side divided.
pub(super) fn mask(frame: &Frame, divisor: u32) -> SurroundMask {
    let side = CELL * divisor as usize;
    let (columns, rows) = (
        (frame.width() as usize).div_ceil(side),
        (frame.height() as usize).div_ceil(side),
    );
    let mut mask = SurroundMask {
        columns,
        dark: vec![false; columns * rows],
    };
    let Some(threshold) = surround_threshold(frame) else {
        return mask;
    };
    let is_dark = |cell: usize| {
        let (left, top) = ((cell % columns) * side, (cell / columns) * side);
        let mut lit = 0;
        for y in (top..(top + side).min(frame.height() as usize)).step_by(divisor as usize) {
            for x in (left..(left + side).min(frame.width() as usize)).step_by(divisor as usize) {
                #[expect(clippy::cast_possible_truncation, reason = "in the frame")]
                let [red, green, blue] = frame.pixel(x as u32, y as u32);
                lit += u32::from(f64::from(red.max(green).max(blue)) > threshold);
            }
        }
        lit <= 2
    };
    let border = (0..columns * rows).filter(|cell| {
        let (column, row) = (cell % columns, cell / columns);
        column == 0 || row == 0 || column + 1 == columns || row + 1 == rows
    });
    let mut open: Vec<usize> = border.collect();
    let mut seen = vec![false; columns * rows];
    let mut filled = Vec::new();
    while let Some(cell) = open.pop() {
        if std::mem::replace(&mut seen[cell], true) || !is_dark(cell) {
            continue;
        }
        filled.push(cell);
        open.extend(neighbors(cell, columns, rows));
    }
    for cell in filled {
        mask.dark[cell] = true;
        for neighbor in neighbors(cell, columns, rows) {
            mask.dark[neighbor] = true;
            for further in neighbors(neighbor, columns, rows) {
                mask.dark[further] = true;
            }
        }
    }
    mask
}

fn neighbors(cell: usize, columns: usize, rows: usize) -> impl Iterator<Item = usize> {
    let (column, row) = (cell % columns, cell / columns);
    let left = (column > 0).then(|| cell - 1);
    let right = (column + 1 < columns).then(|| cell + 1);
    let above = (row > 0).then(|| cell - columns);
    let below = (row + 1 < rows).then(|| cell + columns);
    [left, right, above, below].into_iter().flatten()
}

//! Finds the boxes near a box without looking at all of them.
//!
//! A uniform grid in which every box is listed in each cell it reaches. Cells are at least as
//! large as the mean box, so a box reaches few of them, and at most 64 × 64 in number.

use super::{BBox, FramePixels};

const MAX_CELLS_PER_AXIS: usize = 64;

/// Boxes, numbered in order of insertion, by the cells they reach.
pub(super) struct OverlapGrid {
    columns: Axis,
    rows: Axis,
    cells: Vec<Vec<usize>>,
    reach: Vec<Reach>,
}

impl OverlapGrid {
    /// An empty grid for boxes that lie where `boxes` lie. Others may be inserted and looked for:
    /// the outermost cells go on for ever.
    pub(super) fn covering<'a>(boxes: impl Iterator<Item = &'a BBox<FramePixels>> + Clone) -> Self {
        let columns = Axis::covering(boxes.clone().map(|bbox| (bbox.x_min(), bbox.x_max())));
        let rows = Axis::covering(boxes.map(|bbox| (bbox.y_min(), bbox.y_max())));
        Self {
            cells: vec![Vec::new(); columns.cells * rows.cells],
            columns,
            rows,
            reach: Vec::new(),
        }
    }

    /// Adds a box under the next number.
    pub(super) fn insert(&mut self, bbox: &BBox<FramePixels>) {
        let number = self.reach.len();
        let reach = self.reach_of(bbox);
        for (column, row) in reach.cells() {
            self.cells[row * self.columns.cells + column].push(number);
        }
        self.reach.push(reach);
    }

    /// Tells the grid that box `number` has moved. It stays listed where it was.
    pub(super) fn extend(&mut self, number: usize, bbox: &BBox<FramePixels>) {
        let before = self.reach[number];
        let after = before.union(&self.reach_of(bbox));
        if after == before {
            return;
        }
        for (column, row) in after.cells() {
            if !before.contains(column, row) {
                self.cells[row * self.columns.cells + column].push(number);
            }
        }
        self.reach[number] = after;
    }

    /// Writes to `found`, ascending and each once, the numbers from `first` on of all boxes that
    /// overlap `bbox`, and of some more that are near it. `first` above 0 needs a grid in which no
    /// box was moved.
    pub(super) fn near(&self, bbox: &BBox<FramePixels>, first: usize, found: &mut Vec<usize>) {
        found.clear();
        let reach = self.reach_of(bbox);
        for (column, row) in reach.cells() {
            let listed = &self.cells[row * self.columns.cells + column];
            for &number in listed.iter().rev().take_while(|number| **number >= first) {
                // Two boxes may share many cells; only the first of those counts.
                if reach.first_shared(&self.reach[number]) == (column, row) {
                    found.push(number);
                }
            }
        }
        found.sort_unstable();
    }

    fn reach_of(&self, bbox: &BBox<FramePixels>) -> Reach {
        Reach {
            columns: (
                self.columns.cell(bbox.x_min()),
                self.columns.cell(bbox.x_max()),
            ),
            rows: (self.rows.cell(bbox.y_min()), self.rows.cell(bbox.y_max())),
        }
    }
}

/// First and last column and row that a box reaches.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Reach {
    columns: (usize, usize),
    rows: (usize, usize),
}

impl Reach {
    fn cells(self) -> impl Iterator<Item = (usize, usize)> {
        (self.rows.0..=self.rows.1)
            .flat_map(move |row| (self.columns.0..=self.columns.1).map(move |column| (column, row)))
    }

    fn contains(&self, column: usize, row: usize) -> bool {
        (self.columns.0..=self.columns.1).contains(&column)
            && (self.rows.0..=self.rows.1).contains(&row)
    }

    fn union(&self, other: &Self) -> Self {
        let union = |a: (usize, usize), b: (usize, usize)| (a.0.min(b.0), a.1.max(b.1));
        Self {
            columns: union(self.columns, other.columns),
            rows: union(self.rows, other.rows),
        }
    }

    fn first_shared(&self, other: &Self) -> (usize, usize) {
        (
            self.columns.0.max(other.columns.0),
            self.rows.0.max(other.rows.0),
        )
    }
}

/// Equal cells along one axis.
struct Axis {
    origin: f64,
    cells_per_pixel: f64,
    cells: usize,
}

impl Axis {
    fn covering(ranges: impl Iterator<Item = (f64, f64)>) -> Self {
        let (mut start, mut end) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut sides, mut count) = (0.0, 0.0);
        for (low, high) in ranges {
            start = start.min(low);
            end = end.max(high);
            sides += high - low;
            count += 1.0;
        }
        let extent = end - start;
        // Without boxes, or without extent, the quotient is no number: one cell.
        let cells = to_cell(extent * count / sides).clamp(1, MAX_CELLS_PER_AXIS);
        #[expect(clippy::cast_precision_loss, reason = "at most 64 cells")]
        let cells_per_pixel = cells as f64 / extent;
        Self {
            origin: start,
            cells_per_pixel,
            cells,
        }
    }

    fn cell(&self, position: f64) -> usize {
        to_cell((position - self.origin) * self.cells_per_pixel).min(self.cells - 1)
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "NaN and negative numbers become 0, large ones the largest: the outermost cells"
)]
fn to_cell(position: f64) -> usize {
    position as usize
}

#[cfg(test)]
mod tests;

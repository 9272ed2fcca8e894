//! Index that finds the boxes overlapping a given box without comparing all of them.
//!
//! A uniform grid lists every box in each cell that the box covers. A query for an IoU of at least
//! `t` searches only a part of the queried box. An overlap covers at least the share `t` of each
//! side, since the IoU is at most that share. So it always meets the *core* of the side: the part
//! that remains when `t` is cut off at both ends, which from `t` = ½ on is the center alone. The
//! cells of the core therefore contain all boxes that can match.

use lookdown_lens::saturating::to_usize;

use super::{BBox, FramePixels};

/// Cells along a side of the mean box when whole boxes are searched, and how many more when only
/// their centers are searched. Finer cells reduce the number of neighboring boxes compared.
const CELLS_PER_BOX: [f64; 2] = [1.0, 4.0];
const MAX_CELLS_PER_AXIS: usize = 128;
/// Tolerance of shares of sides relative to IoUs, so that rounding loses no box.
const ROUNDING: f64 = 1e-9;

/// A box of the grid that overlaps the queried box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Overlap {
    /// The number of the box in the grid.
    pub(super) number: usize,
    /// Above 0, at most 1.
    pub(super) iou: f64,
}

/// Boxes, numbered in order of insertion, listed by the cells they cover.
pub(super) struct OverlapGrid {
    columns: Axis,
    rows: Axis,
    cells: Vec<Vec<usize>>,
    boxes: Vec<BBox<FramePixels>>,
    reach: Vec<Reach>,
    least_iou: f64,
    /// Share of a side that is cut off at each end to get its core.
    cut: f64,
}

impl OverlapGrid {
    /// Builds an empty grid sized for `boxes` and for queries with an IoU of at least `least_iou`.
    /// Boxes elsewhere may also be inserted and queried: the outermost cells extend without limit.
    pub(super) fn covering<'a>(
        boxes: impl Iterator<Item = &'a BBox<FramePixels>> + Clone,
        least_iou: f64,
    ) -> Self {
        let cut = least_iou.min(0.5) * (1.0 - ROUNDING);
        let cells_per_box = CELLS_PER_BOX[0] + CELLS_PER_BOX[1] * 2.0 * cut;
        let corners = boxes.map(BBox::corners);
        let columns = corners.clone().map(|[x_min, _, x_max, _]| (x_min, x_max));
        let columns = Axis::covering(columns, cells_per_box);
        let rows = corners.map(|[_, y_min, _, y_max]| (y_min, y_max));
        let rows = Axis::covering(rows, cells_per_box);
        Self {
            cells: vec![Vec::new(); columns.cells * rows.cells],
            columns,
            rows,
            boxes: Vec::new(),
            reach: Vec::new(),
            least_iou,
            cut,
        }
    }

    /// Adds a box with the next number.
    pub(super) fn insert(&mut self, bbox: &BBox<FramePixels>) {
        let number = self.reach.len();
        let reach = self.reach_of(bbox, 0.0);
        for (column, row) in reach.cells() {
            self.cells[row * self.columns.cells + column].push(number);
        }
        self.boxes.push(*bbox);
        self.reach.push(reach);
    }

    /// Moves box `number`. The cells of its earlier positions keep listing it.
    pub(super) fn move_to(&mut self, number: usize, bbox: &BBox<FramePixels>) {
        self.boxes[number] = *bbox;
        let before = self.reach[number];
        let after = before.union(&self.reach_of(bbox, 0.0));
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

    /// Writes to `found` the numbers of all boxes from `first` on that overlap `bbox` with at least
    /// the grid's IoU. The numbers are ascending and unique. `first` above 0 requires a grid in
    /// which no box was moved.
    pub(super) fn overlaps(
        &self,
        bbox: &BBox<FramePixels>,
        first: usize,
        found: &mut Vec<Overlap>,
    ) {
        found.clear();
        let core = self.reach_of(bbox, self.cut);
        for (column, row) in core.cells() {
            let listed = &self.cells[row * self.columns.cells + column];
            for &number in listed.iter().rev().take_while(|number| **number >= first) {
                let iou = bbox.iou(&self.boxes[number]);
                // Two boxes may share many cells. Only the first shared cell counts.
                if iou > 0.0
                    && iou >= self.least_iou
                    && core.first_shared(&self.reach[number]) == (column, row)
                {
                    found.push(Overlap { number, iou });
                }
            }
        }
        found.sort_unstable_by_key(|overlap| overlap.number);
    }

    /// The cells of the part of a box that remains when the share `cut` of each side is cut off at
    /// both of its ends.
    fn reach_of(&self, bbox: &BBox<FramePixels>, cut: f64) -> Reach {
        let (x_cut, y_cut) = (cut * bbox.width(), cut * bbox.height());
        let [x_min, y_min, x_max, y_max] = bbox.corners();
        let (columns, rows) = (&self.columns, &self.rows);
        Reach {
            columns: (columns.cell(x_min + x_cut), columns.cell(x_max - x_cut)),
            rows: (rows.cell(y_min + y_cut), rows.cell(y_max - y_cut)),
        }
    }
}

/// First and last column and row that a box covers.
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
    fn covering(ranges: impl Iterator<Item = (f64, f64)>, cells_per_box: f64) -> Self {
        let (mut start, mut end) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut sides, mut count) = (0.0, 0.0);
        for (low, high) in ranges {
            start = start.min(low);
            end = end.max(high);
            sides += high - low;
            count += 1.0;
        }
        let extent = end - start;
        // Without boxes or without extent the quotient is NaN, which gives one cell.
        let cells = to_usize(cells_per_box * extent * count / sides).clamp(1, MAX_CELLS_PER_AXIS);
        let cells_per_pixel = cells as f64 / extent;
        Self {
            origin: start,
            cells_per_pixel,
            cells,
        }
    }

    fn cell(&self, position: f64) -> usize {
        to_usize((position - self.origin) * self.cells_per_pixel).min(self.cells - 1)
    }
}

#[cfg(test)]
mod tests;

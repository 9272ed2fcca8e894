//! Grids of cells over the network's input.

use std::num::NonZeroU32;

use super::{
    shape::{Axis, Batch},
    tensor::TensorView,
};

/// Cells over the input, row by row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    columns: u32,
    rows: u32,
    /// Width and height of a cell, pixels.
    pub(super) cell: [f64; 2],
}

impl Grid {
    /// The axes of a map over the whole input, rows before columns.
    pub(super) fn axes(batch: &Batch) -> [Axis; 2] {
        [
            Axis::Dividing(batch.height, "rows"),
            Axis::Dividing(batch.width, "columns"),
        ]
    }

    /// The cells of a map whose last two axes are [`Grid::axes`].
    pub(super) fn from_map(map: &TensorView<'_>, batch: &Batch) -> Self {
        let side = |from_last: usize| {
            let index = map.shape.len().checked_sub(from_last);
            let cells = index.and_then(|index| map.shape.get(index));
            cells.map_or(0, |&cells| u32::try_from(cells).unwrap_or(0))
        };
        let (columns, rows) = (side(1), side(2));
        let cell = [
            f64::from(batch.width) / f64::from(columns),
            f64::from(batch.height) / f64::from(rows),
        ];
        Self {
            columns,
            rows,
            cell,
        }
    }

    /// Square cells of `stride` pixels. The last ones may reach beyond the input.
    pub(super) fn from_stride(stride: NonZeroU32, batch: &Batch) -> Self {
        let side = f64::from(stride.get());
        Self {
            columns: batch.width.div_ceil(stride.get()),
            rows: batch.height.div_ceil(stride.get()),
            cell: [side, side],
        }
    }

    /// Number of cells.
    pub(super) fn len(self) -> usize {
        (self.columns as usize).saturating_mul(self.rows as usize)
    }

    /// Column and row of every cell, row by row.
    pub(super) fn cells(self) -> impl Iterator<Item = [f64; 2]> {
        let columns = self.columns;
        (0..self.rows)
            .flat_map(move |row| (0..columns).map(move |column| [column, row].map(f64::from)))
    }

    /// The pixel position of a point given in cells.
    pub(super) fn pixels(self, [column, row]: [f64; 2]) -> [f64; 2] {
        [column * self.cell[0], row * self.cell[1]]
    }
}

/// The usual strides of a feature pyramid.
pub(super) fn default_strides() -> Vec<NonZeroU32> {
    [8, 16, 32]
        .into_iter()
        .filter_map(NonZeroU32::new)
        .collect()
}

/// Number of cells of a pyramid over all its levels.
pub(super) fn pyramid_len(strides: &[NonZeroU32], batch: &Batch) -> usize {
    strides
        .iter()
        .map(|&stride| Grid::from_stride(stride, batch).len())
        .fold(0, usize::saturating_add)
}

/// Each cell of a pyramid, level by level, with its grid.
pub(super) fn pyramid(
    strides: &[NonZeroU32],
    batch: &Batch,
) -> impl Iterator<Item = (Grid, [f64; 2])> {
    strides.iter().flat_map(|&stride| {
        let grid = Grid::from_stride(stride, batch);
        grid.cells().map(move |cell| (grid, cell))
    })
}

//! Size of the object at a peak.

use serde::Deserialize;

use crate::inference::heads::{
    candidate_collector::corners_around, grid::Grid, tensor::TensorView,
};

/// Unit of sizes and sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CenternetUnit {
    /// Cells of the heat map.
    #[default]
    Cells,
    /// Pixels of the network's input.
    Pixels,
}

/// The maps with the extent of objects.
pub(super) enum Extent<'o, T> {
    /// Widths and heights, and the centres within their cells.
    Size(&'o T, Option<&'o T>),
    /// Distances to left, top, right and bottom.
    Sides(&'o T),
}

impl Extent<'_, TensorView<'_>> {
    /// The box of the cell with the number `index`.
    pub(super) fn corners(
        &self,
        view: usize,
        index: usize,
        grid: Grid,
        unit: CenternetUnit,
    ) -> [f64; 4] {
        let in_pixels = |lengths: [f64; 2]| match unit {
            CenternetUnit::Cells => grid.pixels(lengths),
            CenternetUnit::Pixels => lengths,
        };
        let at = |map: &TensorView<'_>, channel: usize| {
            let channels = map.shape[1];
            f64::from(map.values[(view * channels + channel) * grid.len() + index])
        };
        let [column, row] = grid.cell_at(index);
        match self {
            Self::Size(size, offset) => {
                let [x, y] = offset.map_or([0.5; 2], |map| [at(map, 0), at(map, 1)]);
                let center = grid.pixels([column + x, row + y]);
                corners_around(center, in_pixels([at(size, 0), at(size, 1)]))
            }
            Self::Sides(sides) => {
                let [x, y] = grid.pixels([column, row]);
                let [left, top] = in_pixels([at(sides, 0), at(sides, 1)]);
                let [right, bottom] = in_pixels([at(sides, 2), at(sides, 3)]);
                [x - left, y - top, x + right, y + bottom]
            }
        }
    }
}

//! Seconds of presence per cell of the floor.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::tracking::{Plane, Track, TrackId};

/// Most cells of a grid.
pub const MAX_CELLS: usize = 65_536;
/// Side of a cell where none is set, metres.
pub const DEFAULT_CELL_M: f64 = 0.25;
/// Longest time between two places of a track that counts as presence, seconds.
const MAX_GAP_S: f64 = 3.0;

/// A grid of square cells over the floor. Serializable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeatMap {
    origin_m: [f64; 2],
    cell_m: f64,
    columns: usize,
    seconds: Vec<f64>,
    /// Time up to which each current track is counted, seconds since the Unix epoch.
    counted_s: BTreeMap<TrackId, f64>,
}

/// A grid that cannot be laid out, or two that do not fit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum HeatMapError {
    /// Bounds or a cell without a size.
    #[error(
        "the heat map has the bounds {bounds_m:?} and cells of {cell_m} m: give x and y of the least corner, x and y of the greatest one, and a side above 0"
    )]
    Size {
        /// The bounds, metres.
        bounds_m: [f64; 4],
        /// The side of a cell, metres.
        cell_m: f64,
    },
    /// Too many cells.
    #[error("the heat map has {0:.0} cells: make them larger, at most {MAX_CELLS} are kept")]
    Cells(f64),
    /// Two grids with different cells.
    #[error("the two heat maps have different cells: add only those of one floor and cell size")]
    Different,
}

impl HeatMap {
    /// Returns an empty grid of cells with the side `cell_m` over `[x_min, y_min, x_max, y_max]`
    /// metres of the floor.
    ///
    /// # Errors
    /// [`HeatMapError`] without a size, or with more than [`MAX_CELLS`].
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        clippy::cast_sign_loss,
        reason = "limited by MAX_CELLS"
    )]
    pub fn new(bounds_m: [f64; 4], cell_m: f64) -> Result<Self, HeatMapError> {
        let [x_min, y_min, x_max, y_max] = bounds_m;
        let is_finite = bounds_m.iter().all(|bound| bound.is_finite()) && cell_m.is_finite();
        if !(is_finite && x_max > x_min && y_max > y_min && cell_m > 0.0) {
            return Err(HeatMapError::Size { bounds_m, cell_m });
        }
        let columns = ((x_max - x_min) / cell_m).ceil();
        let rows = ((y_max - y_min) / cell_m).ceil();
        let cells = columns * rows;
        // Not so where it is no number either.
        let is_small = cells <= MAX_CELLS as f64;
        if !is_small {
            return Err(HeatMapError::Cells(cells));
        }
        Ok(Self {
            origin_m: [x_min, y_min],
            cell_m,
            columns: columns as usize,
            seconds: vec![0.0; cells as usize],
            counted_s: BTreeMap::new(),
        })
    }

    /// Adds the time up to each new place of the tracks to the cell of that place. `tracks` are all
    /// confirmed tracks of the tracker, after each of its updates.
    pub fn update<'a>(&mut self, tracks: impl IntoIterator<Item = &'a Track>) {
        let mut counted = BTreeMap::new();
        for track in tracks {
            let first = track.first_seen_s();
            let mut until = self.counted_s.get(&track.id()).copied().unwrap_or(first);
            for point in track.tail() {
                if point.at_s <= until {
                    continue;
                }
                let cell = point
                    .place(Plane::FloorM)
                    .and_then(|place| self.cell_of(place));
                if let Some(seconds) = cell.and_then(|cell| self.seconds.get_mut(cell)) {
                    *seconds += (point.at_s - until).min(MAX_GAP_S);
                }
                until = point.at_s;
            }
            counted.insert(track.id(), until);
        }
        self.counted_s = counted;
    }

    /// Adds the seconds of another grid with the same cells.
    ///
    /// # Errors
    /// [`HeatMapError::Different`] when the cells are others.
    pub fn add(&mut self, other: &Self) -> Result<(), HeatMapError> {
        let cells = |grid: &Self| (grid.origin_m, grid.cell_m, grid.columns, grid.seconds.len());
        if cells(self) != cells(other) {
            return Err(HeatMapError::Different);
        }
        for (sum, seconds) in self.seconds.iter_mut().zip(&other.seconds) {
            *sum += seconds;
        }
        Ok(())
    }

    /// Sets every cell to 0 seconds; current tracks go on.
    pub fn clear(&mut self) {
        self.seconds.fill(0.0);
    }

    /// Returns the least corner of the grid, metres on the floor.
    #[must_use]
    pub fn origin_m(&self) -> [f64; 2] {
        self.origin_m
    }

    /// Returns the side of a cell, metres.
    #[must_use]
    pub fn cell_m(&self) -> f64 {
        self.cell_m
    }

    /// Returns the number of cells along x.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Returns the seconds of presence, row by row from the least y on.
    #[must_use]
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.seconds.chunks(self.columns)
    }

    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        clippy::cast_sign_loss,
        reason = "checked against the bounds of the grid"
    )]
    fn cell_of(&self, [x, y]: [f64; 2]) -> Option<usize> {
        let column = ((x - self.origin_m[0]) / self.cell_m).floor();
        let row = ((y - self.origin_m[1]) / self.cell_m).floor();
        let is_inside = column >= 0.0 && row >= 0.0 && column < self.columns as f64;
        is_inside.then(|| (row as usize).saturating_mul(self.columns) + column as usize)
    }
}

#[cfg(test)]
mod tests;

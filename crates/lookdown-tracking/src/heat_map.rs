//! Time of presence per cell of the floor.

use std::collections::BTreeMap;

use lookdown_lens::saturating::to_u64;
use serde::{Deserialize, Serialize};

use crate::{Plane, Track, TrackId};

/// Side of a cell, meters.
pub const CELL_M: f64 = 0.25;
/// Cells on each side of the origin.
const MAX_CELLS_FROM_ORIGIN: f64 = 4096.0;
/// Longest time between two places of a track that counts as presence, seconds.
const MAX_GAP_S: f64 = 3.0;

/// A square cell of the floor: its column and row. The cell (0, 0) begins at the origin and extends
/// toward growing x and y.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Cell {
    /// Cells along x from the origin.
    pub column: i16,
    /// Cells along y from the origin.
    pub row: i16,
}

/// The time of presence since it was last taken, per cell. Its other state is serializable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HeatMap {
    #[serde(skip)]
    milliseconds: BTreeMap<Cell, u64>,
    /// Time up to which each current track is counted, seconds since the Unix epoch.
    counted_s: BTreeMap<TrackId, f64>,
}

impl HeatMap {
    /// Adds the time up to each new place of the tracks to the cell of that place. `tracks` are all
    /// confirmed tracks of the tracker, after each of its updates.
    pub fn update<'a>(&mut self, tracks: impl IntoIterator<Item = &'a Track>) {
        let mut counted = BTreeMap::new();
        for track in tracks {
            let first = track.first_seen_s;
            let mut until = self.counted_s.get(&track.id).copied().unwrap_or(first);
            for point in track.tail() {
                if point.at_s <= until {
                    continue;
                }
                if let Some(cell) = point.place(Plane::FloorM).and_then(Cell::at) {
                    let milliseconds = (point.at_s - until).min(MAX_GAP_S) * 1000.0;
                    *self.milliseconds.entry(cell).or_default() += to_u64(milliseconds.round());
                }
                until = point.at_s;
            }
            counted.insert(track.id, until);
        }
        self.counted_s = counted;
    }

    /// Returns the milliseconds per cell since the last call.
    pub fn take(&mut self) -> BTreeMap<Cell, u64> {
        std::mem::take(&mut self.milliseconds)
    }
}

impl Cell {
    /// Returns the cell of a place in meters. `None` for places more than a kilometer away.
    pub fn at([x, y]: [f64; 2]) -> Option<Self> {
        let index = |meters: f64| {
            let cell = (meters / CELL_M).floor();
            #[expect(clippy::cast_possible_truncation, reason = "within the limit")]
            let index = cell as i16;
            (cell.abs() <= MAX_CELLS_FROM_ORIGIN).then_some(index)
        };
        Some(Self {
            column: index(x)?,
            row: index(y)?,
        })
    }

    /// Returns the corner with the least x and y, meters.
    pub fn corner_m(self) -> [f64; 2] {
        [self.column, self.row].map(|index| f64::from(index) * CELL_M)
    }
}

#[cfg(test)]
mod tests;

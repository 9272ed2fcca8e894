//! Time of presence per cell of the floor.

use std::{
    collections::{BTreeMap, BTreeSet},
    f64::consts::TAU,
};

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

/// The floor on which people walked, as a polygon.
///
/// People walk, so the cells that they were in are connected. A thing that looks like a person
/// stays in a few cells of its own, however long. The largest connected part of the heat map thus
/// is the floor of the room.
///
/// Cells with less presence are noise, milliseconds.
const LEAST_MILLIS: u64 = 500;
/// Cells at most this far apart are connected: a person passes several cells between two frames.
const REACH_CELLS: i16 = 3;
/// The floor around the places where people were, meters.
const AROUND_M: f64 = 0.5;
/// Least floor on which people walked, square meters.
pub const LEAST_WALKED_M2: f64 = 2.0;
/// Directions in which the area is measured, equal to its largest number of corners.
const DIRECTIONS: u32 = 24;

/// Returns the corners of the floor on which people walked and of 0.5 m around it, in meters, at
/// most 24. `presence` has the milliseconds of presence per cell. `None` if less than
/// [`LEAST_WALKED_M2`] are connected.
pub fn walked_area(presence: &BTreeMap<Cell, u64>) -> Option<Vec<[f64; 2]>> {
    let cells = largest_part(presence);
    let floor_m2 = cells.len() as f64 * CELL_M.powi(2);
    (floor_m2 >= LEAST_WALKED_M2).then(|| hull(&cells))
}

/// The largest part of the cells with presence that is connected.
fn largest_part(presence: &BTreeMap<Cell, u64>) -> Vec<Cell> {
    let walked = presence.iter().filter(|(_, time)| **time >= LEAST_MILLIS);
    let mut unseen: BTreeSet<Cell> = walked.map(|(cell, _)| *cell).collect();
    let mut largest = Vec::new();
    while let Some(first) = unseen.pop_first() {
        let mut part = vec![first];
        let mut next = 0;
        while let Some(&cell) = part.get(next) {
            next += 1;
            let around = |at: i16| at.saturating_sub(REACH_CELLS)..=at.saturating_add(REACH_CELLS);
            for row in around(cell.row) {
                for column in around(cell.column) {
                    let near = Cell { column, row };
                    if unseen.remove(&near) {
                        part.push(near);
                    }
                }
            }
        }
        if part.len() > largest.len() {
            largest = part;
        }
    }
    largest
}

/// The convex hull of cells and the floor around them: their extreme points in some directions.
fn hull(cells: &[Cell]) -> Vec<[f64; 2]> {
    let mut corners: Vec<[f64; 2]> = Vec::new();
    for direction in 0..DIRECTIONS {
        let (sin, cos) = (TAU * f64::from(direction) / f64::from(DIRECTIONS)).sin_cos();
        let along = |&[x, y]: &[f64; 2]| x * cos + y * sin;
        let middles = cells
            .iter()
            .map(|cell| cell.corner_m().map(|at| at + CELL_M / 2.0));
        let Some([x, y]) = middles.max_by(|one, other| along(one).total_cmp(&along(other))) else {
            continue;
        };
        let reach = AROUND_M + CELL_M / 2.0;
        let corner =
            [x + reach * cos, y + reach * sin].map(|value| (value * 100.0).round() / 100.0);
        // Corners closer than a cell tell nothing and are hard to drag.
        let is_far = |other: &[f64; 2]| {
            let [x, y] = [0, 1].map(|axis| corner[axis] - other[axis]);
            x.hypot(y) >= CELL_M
        };
        if [corners.first(), corners.last()]
            .into_iter()
            .flatten()
            .all(is_far)
        {
            corners.push(corner);
        }
    }
    corners
}

#[cfg(test)]
mod tests;

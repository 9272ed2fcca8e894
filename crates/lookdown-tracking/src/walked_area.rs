//! The floor on which people walked, as a polygon.
//!
//! People walk, so the cells that they were in are connected. A thing that looks like a person
//! stays in a few cells of its own, however long. The largest connected part of the heat map thus
//! is the floor of the room.

use std::{
    collections::{BTreeMap, BTreeSet},
    f64::consts::TAU,
};

use crate::heat_map::{CELL_M, Cell};

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
mod tests {
    use lookdown_lens::geometry::Polygon;
    use nalgebra::Point2;

    use super::*;

    fn add(presence: &mut BTreeMap<Cell, u64>, column: i16, row: i16, millis: u64) {
        presence.insert(Cell { column, row }, millis);
    }

    #[test]
    fn area_is_the_floor_on_which_people_walked() {
        let mut presence = BTreeMap::new();
        // People walked around a square of 3 m.
        for cell in (-7..=4).step_by(2) {
            for (column, row) in [(cell, -7), (cell, 4), (-7, cell), (4, cell)] {
                add(&mut presence, column, row, 4000);
            }
        }
        // A chair beyond the wall has the most presence.
        for (column, row) in [(10, 10), (10, 11), (11, 10)] {
            add(&mut presence, column, row, 4_000_000);
        }
        assert_eq!(walked_area(&presence), None);
        for column in -6..=3 {
            for row in -6..=3 {
                add(&mut presence, column, row, 1000);
            }
        }
        let area = Polygon::new(&walked_area(&presence).unwrap()).unwrap();
        for (x, y, is_inside) in [
            (-1.6, -1.6, true),
            (1.1, 1.1, true),
            (0.0, -1.9, true),
            (0.0, -2.5, false),
            (2.6, 2.6, false),
        ] {
            assert_eq!(area.holds(Point2::new(x, y)), is_inside, "{x}, {y}");
        }
    }
}

//! The floor on which people walked, as a polygon.
//!
//! People walk, so the cells that they were in are connected. A thing that looks like a person stays in
//! a few cells of its own, however long. The largest connected part of the heat map thus is the floor
//! of the room.

use std::{collections::BTreeSet, f64::consts::TAU};

/// Cells with less presence are noise, seconds.
const LEAST_SECONDS: f64 = 0.5;
/// Cells at most this far apart are connected: a person passes several cells between two frames.
const REACH_CELLS: usize = 3;
/// The floor around the places where people were, meters.
const AROUND_M: f64 = 0.5;
/// Least floor on which people walked, square meters.
const LEAST_M2: f64 = 2.0;
/// Directions in which the area is measured, equal to its largest number of corners.
const DIRECTIONS: u32 = 24;

/// Presence on the floor.
pub(super) struct HeatMap {
    /// The side of a cell, meters.
    pub(super) cell_m: f64,
    /// The corner with the least x and y, meters.
    pub(super) origin_m: [f64; 2],
    /// Seconds of presence, row by row.
    pub(super) seconds: Vec<Vec<f64>>,
}

/// A column and a row.
type Cell = (usize, usize);

/// Returns the corners of the floor on which people walked; `None` if it is too small to be a room.
pub(super) fn walked_area(map: &HeatMap) -> Option<Vec<[f64; 2]>> {
    let cells = largest_part(map);
    #[expect(clippy::cast_precision_loss, reason = "at most 160,000 cells")]
    let floor_m2 = cells.len() as f64 * map.cell_m.powi(2);
    (floor_m2 >= LEAST_M2).then(|| hull(map, &cells))
}

/// The largest part of the cells with presence that is connected.
fn largest_part(map: &HeatMap) -> Vec<Cell> {
    let rows = map.seconds.iter().enumerate();
    let mut unseen: BTreeSet<Cell> = rows
        .flat_map(|(row, seconds)| {
            let columns = seconds.iter().enumerate();
            let walked = columns.filter(|(_, seconds)| **seconds >= LEAST_SECONDS);
            walked.map(move |(column, _)| (column, row))
        })
        .collect();
    let mut largest = Vec::new();
    while let Some(first) = unseen.pop_first() {
        let mut part = vec![first];
        let mut next = 0;
        while let Some(&(column, row)) = part.get(next) {
            next += 1;
            let around = |at: usize| at.saturating_sub(REACH_CELLS)..=at + REACH_CELLS;
            for row in around(row) {
                for column in around(column) {
                    if unseen.remove(&(column, row)) {
                        part.push((column, row));
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
fn hull(map: &HeatMap, cells: &[Cell]) -> Vec<[f64; 2]> {
    let mut corners: Vec<[f64; 2]> = Vec::new();
    for direction in 0..DIRECTIONS {
        let (sin, cos) = (TAU * f64::from(direction) / f64::from(DIRECTIONS)).sin_cos();
        let along = |&[x, y]: &[f64; 2]| x * cos + y * sin;
        let middles = cells.iter().map(|&(column, row)| middle(map, column, row));
        let Some([x, y]) = middles.max_by(|one, other| along(one).total_cmp(&along(other))) else {
            continue;
        };
        let reach = AROUND_M + map.cell_m / 2.0;
        let corner =
            [x + reach * cos, y + reach * sin].map(|value| (value * 100.0).round() / 100.0);
        if corners.last() != Some(&corner) && corners.first() != Some(&corner) {
            corners.push(corner);
        }
    }
    corners
}

fn middle(map: &HeatMap, column: usize, row: usize) -> [f64; 2] {
    #[expect(clippy::cast_precision_loss, reason = "at most 400 cells")]
    let [column, row] = [column, row].map(|cell| cell as f64 + 0.5);
    [
        map.origin_m[0] + column * map.cell_m,
        map.origin_m[1] + row * map.cell_m,
    ]
}

#[cfg(test)]
mod tests {
    use lookdown_lens::geometry::Polygon;
    use nalgebra::Point2;

    use super::*;

    /// 20 × 20 cells of 0.25 m: people walked around a square of 3 m; a chair beyond the wall has
    /// the most presence.
    fn room() -> HeatMap {
        let mut seconds = vec![vec![0.0; 20]; 20];
        for cell in (1..=12).step_by(2) {
            for (column, row) in [(cell, 1), (cell, 12), (1, cell), (12, cell)] {
                seconds[row][column] = 4.0;
            }
        }
        for (column, row) in [(18, 18), (18, 19), (19, 18)] {
            seconds[row][column] = 4000.0;
        }
        HeatMap {
            cell_m: 0.25,
            origin_m: [-2.0, -2.0],
            seconds,
        }
    }

    #[test]
    fn area_is_the_floor_on_which_people_walked() {
        let mut map = room();
        assert_eq!(walked_area(&map), None);
        for row in &mut map.seconds[2..=11] {
            row[2..=11].fill(1.0);
        }
        let area = Polygon::new(&walked_area(&map).unwrap()).unwrap();
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

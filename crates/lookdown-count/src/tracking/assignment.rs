//! The best one-to-one assignment of tracks to persons.

use pathfinding::{kuhn_munkres::kuhn_munkres, matrix::Matrix};

/// Integer steps of a gain of 1: the algorithm compares exactly.
const GAIN_STEPS: f64 = 1e6;
/// Gains beyond this are alike.
const MAX_GAIN: f64 = 1e6;

/// Returns the pairs (row, column) with the greatest sum of gains. A pair whose gain is not above 0
/// is never made; rows and columns may stay alone.
#[allow(
    clippy::cast_possible_truncation,
    reason = "the gain is limited to a range that i64 holds"
)]
pub(super) fn best_pairs(
    rows: usize,
    columns: usize,
    gain: impl Fn(usize, usize) -> f64,
) -> Vec<(usize, usize)> {
    if rows == 0 || columns == 0 {
        return Vec::new();
    }
    // The algorithm wants no more rows than columns.
    let swap = rows > columns;
    let (short, long) = if swap {
        (columns, rows)
    } else {
        (rows, columns)
    };
    let ordered = |(a, b): (usize, usize)| if swap { (b, a) } else { (a, b) };
    let weights = Matrix::from_fn(short, long, |cell| {
        let (row, column) = ordered(cell);
        // Not a number counts as no gain.
        (gain(row, column).max(0.0).min(MAX_GAIN) * GAIN_STEPS).round() as i64
    });
    let (_, matched) = kuhn_munkres(&weights);
    let cells = matched.into_iter().enumerate();
    cells
        .filter(|&cell| weights[cell] > 0)
        .map(ordered)
        .collect()
}

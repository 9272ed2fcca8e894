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
        // A gain that is not a number is none: the conversion makes it 0.
        (gain(row, column).clamp(0.0, MAX_GAIN) * GAIN_STEPS).round() as i64
    });
    let (_, matched) = kuhn_munkres(&weights);
    let cells = matched.into_iter().enumerate();
    cells
        .filter(|&cell| weights[cell] > 0)
        .map(ordered)
        .collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn sum(gains: &[Vec<f64>], pairs: &[(usize, usize)]) -> f64 {
        pairs.iter().map(|&(row, column)| gains[row][column]).sum()
    }

    /// The greatest sum of gains by trying every assignment of the rows from `row` on.
    fn greatest(gains: &[Vec<f64>], row: usize, taken: &mut Vec<usize>) -> f64 {
        let Some(columns) = gains.get(row) else {
            return 0.0;
        };
        let mut best = greatest(gains, row + 1, taken);
        for (column, gain) in columns.iter().enumerate() {
            if *gain > 0.0 && !taken.contains(&column) {
                taken.push(column);
                best = best.max(gain + greatest(gains, row + 1, taken));
                taken.pop();
            }
        }
        best
    }

    #[test]
    fn nothing_is_paired_without_a_gain() {
        assert_eq!(best_pairs(2, 3, |_, _| -1.0), []);
        assert_eq!(best_pairs(2, 3, |_, _| f64::NAN), []);
        assert_eq!(best_pairs(0, 3, |_, _| 1.0), []);
        assert_eq!(best_pairs(3, 0, |_, _| 1.0), []);
    }

    proptest! {
        #[test]
        fn pairs_have_the_greatest_sum_of_gains(
            (rows, columns, gains) in (1..5_usize, 1..5_usize).prop_flat_map(|(rows, columns)| {
                let row = prop::collection::vec(-5.0..10.0_f64, columns);
                (Just(rows), Just(columns), prop::collection::vec(row, rows))
            }),
        ) {
            let pairs = best_pairs(rows, columns, |row, column| gains[row][column]);
            let best = greatest(&gains, 0, &mut Vec::new());
            prop_assert!((sum(&gains, &pairs) - best).abs() < 1e-4);
            prop_assert!(pairs.iter().all(|&(row, column)| gains[row][column] > 0.0));
        }
    }
}

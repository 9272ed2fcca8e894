//! Peaks of a heat map.

/// Returns true if no neighbour in the 3×3 window around a cell is greater. All cells of a plateau
/// are peaks. NaN neighbours are ignored.
pub(super) fn is_peak(plane: &[f32], columns: usize, index: usize) -> bool {
    let (row, column) = (index / columns, index % columns);
    let rows = plane.len() / columns;
    let own = plane[index];
    let near = |position: usize, len: usize| position.saturating_sub(1)..len.min(position + 2);
    near(row, rows).all(|y| {
        let window = &plane[y * columns..][near(column, columns)];
        !window.iter().any(|&neighbour| neighbour > own)
    })
}

/// Keeps the `count` best of the scored cells, in their order. For equal scores, the first are
/// kept.
pub(super) fn keep_best(scored: &mut Vec<(f64, usize)>, count: usize) {
    if scored.len() <= count {
        return;
    }
    scored.select_nth_unstable_by(count, |a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    scored.truncate(count);
    scored.sort_unstable_by_key(|&(_, index)| index);
}

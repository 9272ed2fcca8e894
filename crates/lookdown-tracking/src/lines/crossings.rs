//! Geometry of a polyline: crossings of a step and distance of a point.

use nalgebra::{Point2, Vector2};

/// Returns the crossings of the step `from` – `to` through the polyline to the right-hand side of a
/// walk along it (x right, y down), minus those to the left.
///
/// A point exactly on a line counts as on its left, and so does a corner exactly on the step's
/// line: a step through a corner crosses one of the two segments that meet there, never both or
/// none.
pub(super) fn signed_crossings(points: &[[f64; 2]], from: [f64; 2], to: [f64; 2]) -> i32 {
    let segments = points.windows(2).map(|pair| (pair[0], pair[1]));
    segments
        .map(|(start, end)| {
            let was_right = is_right(start, end, from);
            let is_now_right = is_right(start, end, to);
            let is_within = is_right(from, to, start) != is_right(from, to, end);
            match (is_within, was_right, is_now_right) {
                (true, false, true) => 1,
                (true, true, false) => -1,
                _ => 0,
            }
        })
        .sum()
}

/// Returns true when `point` lies to the right of a walk from `start` to `end`.
fn is_right(start: [f64; 2], end: [f64; 2], point: [f64; 2]) -> bool {
    let along = Vector2::from(end) - Vector2::from(start);
    let to_point = Vector2::from(point) - Vector2::from(start);
    along.perp(&to_point) > 0.0
}

/// Returns the distance of a point from the polyline, its ends included.
pub(super) fn distance(points: &[[f64; 2]], point: [f64; 2]) -> f64 {
    let point = Point2::from(point);
    let segments = points.windows(2);
    segments
        .map(|pair| {
            let start = Point2::from(pair[0]);
            let along = Point2::from(pair[1]) - start;
            let share = (point - start).dot(&along) / along.norm_squared();
            (point - (start + along * share.clamp(0.0, 1.0))).norm()
        })
        .fold(f64::INFINITY, f64::min)
}

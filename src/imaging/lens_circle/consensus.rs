//! The circle that most outline points agree on.
//!
//! Random sample consensus (Fischler and Bolles, 1981) over circles through three points,
//! with a fixed seed: the same frame gives the same circle.

use super::LensCircle;

/// Enough to hit three true points a few times when two thirds are false.
const TRIALS: usize = 400;
/// Fewer points than this agree by chance.
const MIN_AGREEING: usize = 24;

/// The circle with the most points on it, less those outside of it: a dark room moves
/// outline points inward, while only a caption lies outside.
pub(super) fn circle(points: &[[f64; 2]]) -> Option<LensCircle> {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let mut best = None;
    let mut best_score = i64::try_from(MIN_AGREEING).ok()?;
    for _ in 0..TRIALS {
        let triple = [(); 3].map(|()| draw(&mut state, points));
        let [Some(a), Some(b), Some(c)] = triple else {
            return None;
        };
        let Some(candidate) = through(a, b, c) else {
            continue;
        };
        let score = score(&candidate, points);
        if score > best_score {
            best_score = score;
            best = Some(candidate);
        }
    }
    best
}

fn score(circle: &LensCircle, points: &[[f64; 2]]) -> i64 {
    let tolerance = circle.tolerance();
    points
        .iter()
        .map(|point| match circle.distance(*point) {
            distance if distance.abs() <= tolerance => 1,
            distance if distance > tolerance => -1,
            _ => 0,
        })
        .sum()
}

/// A pseudo-random point (xorshift64, Marsaglia 2003).
fn draw(state: &mut u64, points: &[[f64; 2]]) -> Option<[f64; 2]> {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    let index = usize::try_from(*state >> 33)
        .ok()?
        .checked_rem(points.len())?;
    points.get(index).copied()
}

/// The circle through three points; `None` when they are nearly on a line.
fn through(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Option<LensCircle> {
    let (bx, by) = (b[0] - a[0], b[1] - a[1]);
    let (cx, cy) = (c[0] - a[0], c[1] - a[1]);
    let twice_area = bx * cy - by * cx;
    let (b_squared, c_squared) = (bx * bx + by * by, cx * cx + cy * cy);
    // On a large circle, a short arc looks like a line: the area is small for the sides.
    if twice_area.abs() < 0.01 * b_squared.max(c_squared) {
        return None;
    }
    let x = (cy * b_squared - by * c_squared) / (2.0 * twice_area);
    let y = (bx * c_squared - cx * b_squared) / (2.0 * twice_area);
    Some(LensCircle {
        cx: a[0] + x,
        cy: a[1] + y,
        radius: x.hypot(y),
    })
}

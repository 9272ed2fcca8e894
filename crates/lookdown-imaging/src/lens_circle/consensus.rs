//! The circle on which most outline points agree.
//!
//! Random sample consensus (Fischler and Bolles, 1981) over circles through three points, with a
//! fixed seed: the same frame gives the same circle.

use super::LensCircle;

/// Enough to draw three true points a few times when two thirds are false.
const TRIALS: usize = 400;
/// Fewer agreeing points can occur by chance.
const MIN_AGREEING: usize = 24;

/// Returns the circle with the most points on it, minus the points outside of it. A dark room moves
/// outline points inward, whereas only captions lie outside.
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
    // Compares squares, which avoids a square root for each trial and point.
    let [nearest, farthest] =
        [-tolerance, tolerance].map(|off| (circle.radius + off).max(0.0).powi(2));
    points
        .iter()
        .map(|[x, y]| {
            let squared = (x - circle.cx).powi(2) + (y - circle.cy).powi(2);
            i64::from(squared >= nearest) - 2 * i64::from(squared > farthest)
        })
        .sum()
}

/// Draws a pseudo-random point (xorshift64, Marsaglia 2003).
fn draw(state: &mut u64, points: &[[f64; 2]]) -> Option<[f64; 2]> {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    let index = usize::try_from(*state >> 33)
        .ok()?
        .checked_rem(points.len())?;
    points.get(index).copied()
}

/// The circle through three points, or `None` when they are nearly collinear.
///
/// Its center has the same distance from all three points, which gives two linear equations, solved
/// by Cramer's rule.
fn through(first: [f64; 2], second: [f64; 2], third: [f64; 2]) -> Option<LensCircle> {
    let [u, v] = [second[0] - first[0], second[1] - first[1]];
    let [s, t] = [third[0] - first[0], third[1] - first[1]];
    let (near, far) = (u * u + v * v, s * s + t * t);
    let twice_area = u * t - v * s;
    // On a large circle, a short arc is almost a line: the area is small compared with the sides.
    if twice_area.abs() < 0.01 * near.max(far) {
        return None;
    }
    let across = (t * near - v * far) / (2.0 * twice_area);
    let down = (u * far - s * near) / (2.0 * twice_area);
    Some(LensCircle {
        cx: first[0] + across,
        cy: first[1] + down,
        radius: across.hypot(down),
    })
}

//! Detection of the lens image in a fisheye frame: a bright disc on a black surround.
//!
//! 1. The corners give the brightness of the surround (`surround`).
//! 2. Scans along rows and columns, from the border inward, reach the disc. A consensus circle
//!    through those points ignores captions and unlit parts of the room (`outline`, `consensus`).
//! 3. Along rays near that circle the rim is located to a fraction of a pixel, and a robust
//!    least-squares circle is fitted to it (`rim`, `least_squares`).
//!
//! The circle on which most outline points agree.
//!
//! Random sample consensus (Fischler and Bolles, 1981) over circles through three points, with a
//! fixed seed: the same frame gives the same circle.
//!
//! The circle that fits rim points best, robust against a minority of outliers.
//!
//! Iteratively reweighted Gauss–Newton on the geometric distance, with Tukey's biweight (Holland
//! and Welsch, 1977), which gives distant points no weight.

mod agreement;
mod circle;
mod rim;
mod surround;

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};

use crate::frame::Frame;

use rim::RimPoint;
use surround::{Surround, brightness, margin};

pub use agreement::{AgreedCircle, agreed_circle};
pub use circle::LensCircle;

/// Frames with a shorter side below this show too little of a rim to measure.
const MIN_SIDE: u32 = 32;
/// Least contrast between lens image and surround, relative to the brightness of the frame's
/// center. The first value ignores stray light around the lens image. The second is for lenses that
/// darken toward the rim.
const MIN_CONTRASTS: [f64; 2] = [0.1, 0.03];
/// Search range for the rim on either side of the current circle, in radii. The first is wide, to
/// recover from a rough consensus.
const REACHES: [f64; 3] = [0.04, 0.02, 0.02];
/// A smaller circle is a lamp or a table.
const MIN_RADIUS_IN_SHORT_SIDES: f64 = 0.25;
/// Share of the rays meeting the circle inside the frame that must show a rim. The others may show
/// a dark part of the room.
const MIN_SUPPORT: f64 = 0.35;
/// Farthest middle of a circle from that of its half of a frame of two lenses.
const MAX_OFFSET_IN_RADII: f64 = 0.25;
/// The widest angle without any rim. Beyond it, center and radius are ambiguous.
const MAX_GAP_RADIANS: f64 = 3.5;

/// Finds the lens circle to a fraction of a pixel. The frame may cut it off.
///
/// Returns `None` where no dark surround shows it: in a frame filled by the lens image, an image of
/// an ordinary camera, or a dark room. Use [`assumed_circle`] then. The result is deterministic.
pub fn find_lens_circle(frame: &Frame) -> Option<LensCircle> {
    if short_side(frame) < MIN_SIDE {
        return None;
    }
    MIN_CONTRASTS
        .into_iter()
        .find_map(|min_contrast| find_at_contrast(frame, min_contrast))
}

fn find_at_contrast(frame: &Frame, min_contrast: f64) -> Option<LensCircle> {
    let surround = Surround::new(frame, min_contrast)?;
    let mut circle = consensus_circle(&outline_points(frame, &surround))?;
    let mut edge = Vec::new();
    for reach in REACHES {
        edge = rim::points(frame, &surround, &circle, reach);
        let points: Vec<_> = edge.iter().map(|point| point.at).collect();
        circle = fitted_circle(&points, &circle)?;
    }
    let is_large = circle.radius >= MIN_RADIUS_IN_SHORT_SIDES * f64::from(short_side(frame));
    (is_large && is_shown(&edge, frame, &circle)).then_some(circle)
}

/// Brightness (0 to 255) above which a pixel is lens image, or `None` in a frame without a dark
/// surround.
pub fn surround_threshold(frame: &Frame) -> Option<f64> {
    if short_side(frame) < MIN_SIDE {
        return None;
    }
    let surround = Surround::new(frame, MIN_CONTRASTS[1])?;
    Some(surround.threshold)
}

fn short_side(frame: &Frame) -> u32 {
    frame.width().min(frame.height())
}

/// Returns true if enough of the circle's rim was found, all around it.
fn is_shown(edge: &[RimPoint], frame: &Frame, circle: &LensCircle) -> bool {
    let shown: Vec<f64> = edge
        .iter()
        .filter(|point| circle.distance(point.at).abs() <= circle.tolerance())
        .map(|point| point.angle)
        .collect();
    let next_round = shown.first().map(|first| first + TAU);
    let widest_gap = shown
        .iter()
        .zip(shown.iter().skip(1).chain(&next_round))
        .map(|(angle, next)| next - angle)
        .fold(0.0, f64::max);
    let visible = rim::visible_rays(frame, circle);
    let is_supported = shown.len() as f64 >= MIN_SUPPORT * visible as f64;
    !shown.is_empty() && is_supported && widest_gap <= MAX_GAP_RADIANS
}

/// Returns true for a frame of two lenses, beside or above each other: each half has a lens circle
/// in its middle. The halves of one lens circle have its middle at their edge.
pub fn shows_two_circles(frame: &Frame) -> bool {
    let (width, height) = (frame.width(), frame.height());
    let halves = if 2 * width >= 3 * height {
        let middle = width / 2;
        [(0..middle, 0..height), (middle..width, 0..height)]
    } else if 2 * height >= 3 * width {
        let middle = height / 2;
        [(0..width, 0..middle), (0..width, middle..height)]
    } else {
        return false;
    };
    halves.into_iter().all(|(columns, rows)| {
        let Ok(half) = frame.crop(columns, rows) else {
            return false;
        };
        let middle = assumed_circle(half.width(), half.height());
        find_lens_circle(&half).is_some_and(|circle| {
            let offset = (circle.cx - middle.cx).hypot(circle.cy - middle.cy);
            offset <= MAX_OFFSET_IN_RADII * middle.radius
        })
    })
}

/// The largest circle in the center of a frame of this size. It is the guess for frames without a
/// detected circle.
pub fn assumed_circle(width: u32, height: u32) -> LensCircle {
    LensCircle {
        cx: (f64::from(width) - 1.0) / 2.0,
        cy: (f64::from(height) - 1.0) / 2.0,
        radius: f64::from(width.min(height)) / 2.0,
    }
}

/// Enough to draw three true points a few times when two thirds are false.
const TRIALS: usize = 400;
/// Fewer agreeing points can occur by chance.
const MIN_AGREEING: usize = 24;

/// Returns the circle with the most points on it, minus the points outside of it. A dark room moves
/// outline points inward, whereas only captions lie outside.
fn consensus_circle(points: &[[f64; 2]]) -> Option<LensCircle> {
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

const ITERATIONS: usize = 12;
/// Tukey's constant: 95 % efficiency on normally distributed errors.
const CUTOFF_IN_SIGMAS: f64 = 4.685;
/// The standard deviation of a normal distribution in median absolute deviations.
const SIGMA_IN_MEDIAN_DEVIATIONS: f64 = 1.4826;
/// A smaller spread, in pixels, is numerical noise and would exclude good points.
const MIN_SIGMA: f64 = 0.25;
/// A circle has three unknowns. Fewer points leave no redundancy to detect outliers.
const MIN_POINTS: usize = 12;

/// Fits a circle to points, starting from `start`. Returns `None` when there are too few points or
/// they do not determine a circle.
fn fitted_circle(points: &[[f64; 2]], start: &LensCircle) -> Option<LensCircle> {
    if points.len() < MIN_POINTS {
        return None;
    }
    let mut circle = *start;
    for _ in 0..ITERATIONS {
        let cutoff = CUTOFF_IN_SIGMAS * spread(points, &circle);
        let mut normal = Matrix3::zeros();
        let mut right_side = Vector3::zeros();
        for point in points {
            let distance = circle.distance(*point);
            let weight = (1.0 - (distance / cutoff).powi(2)).max(0.0).powi(2);
            let from_center = distance + circle.radius;
            let gradient = Vector3::new(
                (point[0] - circle.cx) / from_center,
                (point[1] - circle.cy) / from_center,
                1.0,
            );
            normal += weight * gradient * gradient.transpose();
            right_side += weight * distance * gradient;
        }
        let step = normal.cholesky()?.solve(&right_side);
        circle.cx += step.x;
        circle.cy += step.y;
        circle.radius += step.z;
        if !(step.norm().is_finite() && circle.radius > 1.0) {
            return None;
        }
    }
    Some(circle)
}

/// Robust standard deviation of the points around the circle, in pixels.
fn spread(points: &[[f64; 2]], circle: &LensCircle) -> f64 {
    let mut deviations: Vec<f64> = points
        .iter()
        .map(|point| circle.distance(*point).abs())
        .collect();
    let middle = deviations.len() / 2;
    let (_, median, _) = deviations.select_nth_unstable_by(middle, f64::total_cmp);
    (*median * SIGMA_IN_MEDIAN_DEVIATIONS).max(MIN_SIGMA)
}

/// Scan lines across each axis of the frame. Rows and columns together cover the outline of a
/// circle almost evenly.
const LINES: u32 = 160;

/// One point per scan line and side, in pixel centers, precise to about a pixel. Lines that start
/// inside the lens image, because the circle is cut off there, give no point.
fn outline_points(frame: &Frame, surround: &Surround) -> Vec<[f64; 2]> {
    let (width, height) = (frame.width(), frame.height());
    let mut points = Vec::new();
    for line in 0..LINES {
        let y = middle_of_slice(line, height);
        let row = |x: u32| is_lit(frame, surround, x, y);
        let (left, right) = (
            entry(width, frame, row),
            entry(width, frame, |x| row(width - 1 - x)),
        );
        points.extend(left.map(|x| [x, f64::from(y)]));
        points.extend(right.map(|x| [f64::from(width - 1) - x, f64::from(y)]));

        let x = middle_of_slice(line, width);
        let column = |y: u32| is_lit(frame, surround, x, y);
        let (top, bottom) = (
            entry(height, frame, column),
            entry(height, frame, |y| column(height - 1 - y)),
        );
        points.extend(top.map(|y| [f64::from(x), y]));
        points.extend(bottom.map(|y| [f64::from(x), f64::from(height - 1) - y]));
    }
    points
}

/// The pixel in the center of one of [`LINES`] equal slices of a side.
fn middle_of_slice(line: u32, side: u32) -> u32 {
    let middle = u64::from(2 * line + 1) * u64::from(side) / u64::from(2 * LINES);
    u32::try_from(middle).unwrap_or(side - 1)
}

fn is_lit(frame: &Frame, surround: &Surround, x: u32, y: u32) -> bool {
    f64::from(brightness(frame.pixel(x, y))) > surround.threshold
}

/// The number of pixels before a scan stays lit for several pixels. Specks, and most strokes of a
/// caption, are shorter.
fn entry(length: u32, frame: &Frame, is_lit: impl Fn(u32) -> bool) -> Option<f64> {
    let run_length = (frame.width().min(frame.height()) / 150).max(3);
    let start = margin(frame);
    if (start..start + run_length).any(&is_lit) {
        return None;
    }
    let mut run = 0;
    for at in start..length {
        run = if is_lit(at) { run + 1 } else { 0 };
        if run == run_length {
            return Some(f64::from(at + 1 - run_length) - 0.5);
        }
    }
    None
}

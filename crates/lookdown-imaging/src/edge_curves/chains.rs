//! Chains of edge pixels with interpolated positions.

use super::gradient::Gradient;

/// Chains with fewer pixels are noise.
const MIN_PIXELS: usize = 14;
/// Least cosine between the gradients of neighbors.
const MIN_COSINE: f32 = 0.88;
/// The eight neighbors, clockwise from the right.
const NEIGHBORS: [[i32; 2]; 8] = [
    [1, 0],
    [1, 1],
    [0, 1],
    [-1, 1],
    [-1, 0],
    [-1, -1],
    [0, -1],
    [1, -1],
];

/// Returns chains of points in pixel centers of the gradient.
pub(super) fn linked(
    gradient: &Gradient,
    is_used: &dyn Fn([f64; 2]) -> bool,
) -> Vec<Vec<[f64; 2]>> {
    let width = gradient.width;
    let mut free = maxima(gradient, is_used);
    let mut seeds: Vec<usize> = (0..free.len()).filter(|at| free[*at]).collect();
    seeds.sort_by(|a, b| gradient.size[*b].total_cmp(&gradient.size[*a]));
    let mut chains = Vec::new();
    for seed in seeds {
        if !std::mem::replace(&mut free[seed], false) {
            continue;
        }
        let mut pixels: Vec<usize> = walk(gradient, &mut free, seed, 1.0);
        pixels.reverse();
        pixels.push(seed);
        pixels.extend(walk(gradient, &mut free, seed, -1.0));
        if pixels.len() >= MIN_PIXELS {
            chains.push(
                pixels
                    .into_iter()
                    .map(|at| position(gradient, at, width))
                    .collect(),
            );
        }
    }
    chains
}

/// Pixels whose gradient is a maximum along its dominant axis.
fn maxima(gradient: &Gradient, is_used: &dyn Fn([f64; 2]) -> bool) -> Vec<bool> {
    let width = gradient.width;
    let mut maxima = vec![false; gradient.size.len()];
    for y in 5..gradient.height.saturating_sub(5) {
        for x in 5..width - 5 {
            let at = y * width + x;
            let size = gradient.size[at];
            if size < gradient.threshold {
                continue;
            }
            let step = dominant_step(gradient, at);
            if size > gradient.size[at - step] && size >= gradient.size[at + step] {
                let point = [x as f64, y as f64];
                maxima[at] = is_used(point);
            }
        }
    }
    maxima
}

/// Distance between the neighbors along the axis in which the gradient is larger.
fn dominant_step(gradient: &Gradient, at: usize) -> usize {
    if gradient.along_x[at].abs() >= gradient.along_y[at].abs() {
        1
    } else {
        gradient.width
    }
}

/// Follows an edge from a pixel in one of its two senses.
fn walk(gradient: &Gradient, free: &mut [bool], seed: usize, sense: f32) -> Vec<usize> {
    let mut pixels = Vec::new();
    let mut at = seed;
    while let Some(next) = next_pixel(gradient, free, at, sense) {
        free[next] = false;
        pixels.push(next);
        at = next;
    }
    pixels
}

fn next_pixel(gradient: &Gradient, free: &[bool], at: usize, sense: f32) -> Option<usize> {
    let (gx, gy) = (gradient.along_x[at], gradient.along_y[at]);
    let (tx, ty) = (-gy * sense, gx * sense);
    let turns = ty.atan2(tx) / std::f32::consts::FRAC_PI_4;
    #[expect(clippy::cast_possible_truncation, reason = "between -4 and 4")]
    let octant = turns.round() as i32;
    let candidate = |far: i32, side: i32| {
        let index = usize::try_from((octant + side).rem_euclid(8)).ok()?;
        let [x, y] = NEIGHBORS[index];
        let offset = far * (y * i32::try_from(gradient.width).ok()? + x);
        let next = at.checked_add_signed(offset as isize)?;
        let (nx, ny) = (gradient.along_x[next], gradient.along_y[next]);
        let cosine = (gx * nx + gy * ny) / (gradient.size[at] * gradient.size[next]).max(1e-6);
        (*free.get(next)? && cosine > MIN_COSINE).then_some(next)
    };
    for far in [1, 2] {
        let found = [0, -1, 1]
            .into_iter()
            .filter_map(|side| candidate(far, side));
        let strongest = found.max_by(|a, b| gradient.size[*a].total_cmp(&gradient.size[*b]));
        if strongest.is_some() {
            return strongest;
        }
    }
    None
}

/// The position of the maximum across the edge: the vertex of a parabola through three pixels.
fn position(gradient: &Gradient, at: usize, width: usize) -> [f64; 2] {
    let step = dominant_step(gradient, at);
    let [before, here, after] = [at - step, at, at + step].map(|at| f64::from(gradient.size[at]));
    let bend = before - 2.0 * here + after;
    let shift = if bend < -1e-6 {
        (0.5 * (before - after) / bend).clamp(-0.5, 0.5)
    } else {
        0.0
    };
    let (x, y) = ((at % width) as f64, (at / width) as f64);
    if step == 1 {
        [x + shift, y]
    } else {
        [x, y + shift]
    }
}

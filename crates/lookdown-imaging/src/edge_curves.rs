//! Smooth edges of a frame with subpixel positions, for the fit of its camera.
//!
//! 1. Gradient of the smoothed luminance (`gradient`).
//! 2. Maxima across the edge are linked to chains, whose positions are interpolated (`chains`).
//! 3. Chains are split at corners into pieces that a parabola describes (`pieces`). The image of a
//!    straight edge in a fisheye frame is such a piece.

use lookdown_lens::{saturating::to_usize, self_calibration::EdgeCurve};

use crate::{
    frame::Frame,
    lens_circle::{LensCircle, surround_threshold},
};

/// Rasters with a shorter side have no edges of a room.
const MIN_SIDE: u32 = 32;
/// Longer sides are halved, or divided by three, and so on.
const MAX_SIDE: u32 = 1700;
/// Rasters in which edges are found: the finest, then each of half of the sides before.
pub(super) const RASTERS: usize = 3;
/// Share of the radius that is used: the rim itself is an edge, too.
pub(super) const USED_RADIUS: f64 = 0.975;

/// Returns the smooth edges inside a circle, in pixel centers of the frame: those of the finest
/// raster first.
pub fn edge_curves(frame: &Frame, circle: &LensCircle) -> [Vec<EdgeCurve>; RASTERS] {
    let finest = frame.width().max(frame.height()).div_ceil(MAX_SIDE);
    std::array::from_fn(|raster| curves_of_raster(frame, circle, finest << raster))
}

/// The edges of a frame whose sides are divided.
fn curves_of_raster(frame: &Frame, circle: &LensCircle, divisor: u32) -> Vec<EdgeCurve> {
    if frame.width().min(frame.height()) / divisor < MIN_SIDE {
        return Vec::new();
    }
    let luminance = Plane::luminance(frame, divisor);
    let surround = surround_mask(frame, divisor);
    let gradient = Gradient::new(&luminance);
    let scale = f64::from(divisor);
    // The center of the first pixel of the smaller plane.
    let origin = (scale - 1.0) / 2.0;
    let in_frame = |[x, y]: [f64; 2]| [x * scale + origin, y * scale + origin];
    let is_used = |point: [f64; 2]| {
        let [x, y] = in_frame(point);
        (x - circle.cx).hypot(y - circle.cy) < USED_RADIUS * circle.radius
            && !surround.contains(point)
    };
    let mut curves = Vec::new();
    for chain in linked_chains(&gradient, &is_used) {
        for piece in smooth_pieces(&chain) {
            let points = supports(piece).into_iter().map(in_frame).collect();
            curves.push(EdgeCurve { points, scale });
        }
    }
    curves
}

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
fn linked_chains(gradient: &Gradient, is_used: &dyn Fn([f64; 2]) -> bool) -> Vec<Vec<[f64; 2]>> {
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

/// Largest distance of a point from the parabola through its piece, pixels.
const TOLERANCE: f64 = 1.0;
/// Shorter pieces say little about a direction, pixels.
const MIN_LENGTH: f64 = 14.0;
/// Points left out at both ends, where a corner bends the edge.
const ENDS: usize = 2;
/// Distance of the supports, in pixels.
const SUPPORT_DISTANCE: f64 = 8.0;
/// Most supports of a piece.
const MAX_SUPPORTS: f64 = 24.0;

/// Splits a chain at its corners.
fn smooth_pieces(chain: &[[f64; 2]]) -> Vec<&[[f64; 2]]> {
    let mut open = vec![chain];
    let mut pieces = Vec::new();
    while let Some(piece) = open.pop() {
        let (Some(first), Some(last)) = (piece.first(), piece.last()) else {
            continue;
        };
        let length = (last[0] - first[0]).hypot(last[1] - first[1]);
        if piece.len() < 2 * ENDS + 6 {
            continue;
        }
        if length >= 0.5 * count(piece.len()) && is_parabola(piece, *first, *last, length) {
            if length >= MIN_LENGTH {
                pieces.push(&piece[ENDS..piece.len() - ENDS]);
            }
            continue;
        }
        let corner = farthest(piece, *first, *last).clamp(3, piece.len() - 4);
        open.push(&piece[..=corner]);
        open.push(&piece[corner..]);
    }
    pieces
}

fn count(length: usize) -> f64 {
    length as f64
}

/// Index of the point farthest from the chord.
fn farthest(piece: &[[f64; 2]], first: [f64; 2], last: [f64; 2]) -> usize {
    let [x, y] = [last[0] - first[0], last[1] - first[1]];
    let far = |point: &[f64; 2]| {
        let [px, py] = [point[0] - first[0], point[1] - first[1]];
        if x.hypot(y) < 3.0 {
            px.hypot(py)
        } else {
            (px * y - py * x).abs()
        }
    };
    let indexed = piece.iter().enumerate();
    indexed
        .max_by(|a, b| far(a.1).total_cmp(&far(b.1)))
        .map_or(0, |(index, _)| index)
}

/// Returns true if a parabola over the chord describes the piece.
fn is_parabola(piece: &[[f64; 2]], first: [f64; 2], last: [f64; 2], length: f64) -> bool {
    let [x, y] = [(last[0] - first[0]) / length, (last[1] - first[1]) / length];
    let local = |point: &[f64; 2]| {
        let [px, py] = [point[0] - first[0], point[1] - first[1]];
        // Along the chord from -1 to 1, and across it in pixels.
        [2.0 * (px * x + py * y) / length - 1.0, py * x - px * y]
    };
    let mut normal = nalgebra::Matrix3::<f64>::zeros();
    let mut right = nalgebra::Vector3::<f64>::zeros();
    for point in piece {
        let [along, across] = local(point);
        let row = nalgebra::Vector3::new(1.0, along, along * along);
        normal += row * row.transpose();
        right += row * across;
    }
    let Some(cholesky) = normal.cholesky() else {
        return false;
    };
    let coefficients = cholesky.solve(&right);
    let inner = &piece[ENDS..piece.len() - ENDS];
    inner.iter().all(|point| {
        let [along, across] = local(point);
        let fitted = coefficients[0] + along * (coefficients[1] + along * coefficients[2]);
        (across - fitted).abs() <= TOLERANCE
    })
}

/// Averages groups of points to supports, whose noise is smaller.
fn supports(piece: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let wanted = (count(piece.len()) / SUPPORT_DISTANCE).clamp(3.0, MAX_SUPPORTS);
    let wanted = to_usize(wanted.round());
    let mean = |index: usize| {
        let group = &piece[index * piece.len() / wanted..(index + 1) * piece.len() / wanted];
        let share = 1.0 / count(group.len()).max(1.0);
        group.iter().fold([0.0, 0.0], |sum, point| {
            [sum[0] + share * point[0], sum[1] + share * point[1]]
        })
    };
    (0..wanted).map(mean).collect()
}

/// Gaussian of 1.1 pixels.
const KERNEL: [f32; 7] = [
    0.008_831, 0.069_737, 0.241_062, 0.360_740, 0.241_062, 0.069_737, 0.008_831,
];
/// Least gradient of an edge, luminance per pixel, whatever the noise.
const MIN_EDGE: f32 = 0.7;
/// Largest threshold, luminance per pixel: a textured room has its edges nevertheless.
const MAX_EDGE: f32 = 4.0;
/// Threshold in medians of the gradient.
const EDGE_IN_MEDIANS: f32 = 2.5;

/// Gradient per pixel.
struct Gradient {
    pub width: usize,
    pub height: usize,
    pub along_x: Vec<f32>,
    pub along_y: Vec<f32>,
    pub size: Vec<f32>,
    /// Smaller gradients are not edges.
    pub threshold: f32,
}

impl Gradient {
    fn new(luminance: &Plane) -> Self {
        let smooth = luminance.blurred(&KERNEL);
        let (width, height) = (smooth.width, smooth.height);
        let count = width * height;
        let mut gradient = Self {
            width,
            height,
            along_x: vec![0.0; count],
            along_y: vec![0.0; count],
            size: vec![0.0; count],
            threshold: MIN_EDGE,
        };
        for y in 4..height.saturating_sub(4) {
            for x in 4..width.saturating_sub(4) {
                let at = y * width + x;
                let across = 0.5 * (smooth.values[at + 1] - smooth.values[at - 1]);
                let down = 0.5 * (smooth.values[at + width] - smooth.values[at - width]);
                gradient.along_x[at] = across;
                gradient.along_y[at] = down;
                gradient.size[at] = (across * across + down * down).sqrt();
            }
        }
        let mut sample: Vec<f32> = gradient
            .size
            .iter()
            .step_by(7)
            .copied()
            .filter(|size| *size > 0.05)
            .collect();
        if !sample.is_empty() {
            let middle = sample.len() / 2;
            let (_, median, _) = sample.select_nth_unstable_by(middle, f32::total_cmp);
            gradient.threshold = (EDGE_IN_MEDIANS * *median).clamp(MIN_EDGE, MAX_EDGE);
        }
        gradient
    }
}

/// Side of a cell, in pixels of the divided frame.
const CELL: usize = 4;

/// Cells that are dark and connected with the border of the frame, and their neighbors.
struct SurroundMask {
    columns: usize,
    dark: Vec<bool>,
}

impl SurroundMask {
    fn contains(&self, [x, y]: [f64; 2]) -> bool {
        let [column, row] = [x, y].map(|at| to_usize(at) / CELL);
        self.dark
            .get(row * self.columns + column)
            .copied()
            .unwrap_or(true)
    }
}

/// Returns the surround of a frame, each side divided.
fn surround_mask(frame: &Frame, divisor: u32) -> SurroundMask {
    let side = CELL * divisor as usize;
    let (columns, rows) = (
        (frame.width() as usize).div_ceil(side),
        (frame.height() as usize).div_ceil(side),
    );
    let mut mask = SurroundMask {
        columns,
        dark: vec![false; columns * rows],
    };
    let Some(threshold) = surround_threshold(frame) else {
        return mask;
    };
    let is_dark = |cell: usize| {
        let (left, top) = ((cell % columns) * side, (cell / columns) * side);
        let mut lit = 0;
        for y in (top..(top + side).min(frame.height() as usize)).step_by(divisor as usize) {
            for x in (left..(left + side).min(frame.width() as usize)).step_by(divisor as usize) {
                #[expect(clippy::cast_possible_truncation, reason = "in the frame")]
                let [red, green, blue] = frame.pixel(x as u32, y as u32);
                lit += u32::from(f64::from(red.max(green).max(blue)) > threshold);
            }
        }
        lit <= 2
    };
    let border = (0..columns * rows).filter(|cell| {
        let (column, row) = (cell % columns, cell / columns);
        column == 0 || row == 0 || column + 1 == columns || row + 1 == rows
    });
    let mut open: Vec<usize> = border.collect();
    let mut seen = vec![false; columns * rows];
    let mut filled = Vec::new();
    while let Some(cell) = open.pop() {
        if std::mem::replace(&mut seen[cell], true) || !is_dark(cell) {
            continue;
        }
        filled.push(cell);
        open.extend(neighbors(cell, columns, rows));
    }
    for cell in filled {
        mask.dark[cell] = true;
        for neighbor in neighbors(cell, columns, rows) {
            mask.dark[neighbor] = true;
            for further in neighbors(neighbor, columns, rows) {
                mask.dark[further] = true;
            }
        }
    }
    mask
}

fn neighbors(cell: usize, columns: usize, rows: usize) -> impl Iterator<Item = usize> {
    let (column, row) = (cell % columns, cell / columns);
    let left = (column > 0).then(|| cell - 1);
    let right = (column + 1 < columns).then(|| cell + 1);
    let above = (row > 0).then(|| cell - columns);
    let below = (row + 1 < rows).then(|| cell + columns);
    [left, right, above, below].into_iter().flatten()
}

/// A raster of numbers, row by row.
struct Plane {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f32>,
}

impl Plane {
    /// The luminance of a frame (ITU-R BT.601), each side divided.
    pub(super) fn luminance(frame: &Frame, divisor: u32) -> Self {
        let step = divisor as usize;
        let (width, height) = (
            frame.width() as usize / step,
            frame.height() as usize / step,
        );
        let line = 3 * frame.width() as usize;
        let pixels = frame.pixels();
        let mut values = vec![0.0; width * height];
        let share = 1.0 / (step * step) as f32;
        for (y, row) in values.chunks_exact_mut(width).enumerate() {
            for inner in 0..step {
                let source = &pixels[(y * step + inner) * line..][..3 * step * width];
                for (value, group) in row.iter_mut().zip(source.chunks_exact(3 * step)) {
                    for rgb in group.chunks_exact(3) {
                        *value += share
                            * (0.299 * f32::from(rgb[0])
                                + 0.587 * f32::from(rgb[1])
                                + 0.114 * f32::from(rgb[2]));
                    }
                }
            }
        }
        Self {
            width,
            height,
            values,
        }
    }

    /// The plane after a Gaussian blur. The border of the width of the kernel stays as it was.
    pub(super) fn blurred(&self, kernel: &[f32]) -> Self {
        let reach = kernel.len() / 2;
        let mut across = self.values.clone();
        for (target, source) in across
            .chunks_exact_mut(self.width)
            .zip(self.values.chunks_exact(self.width))
        {
            for (value, window) in target[reach..].iter_mut().zip(source.windows(kernel.len())) {
                *value = window
                    .iter()
                    .zip(kernel)
                    .map(|(value, weight)| value * weight)
                    .sum();
            }
        }
        let mut values = across.clone();
        let rows = self.height.saturating_sub(2 * reach);
        for y in 0..rows {
            let target = &mut values[(y + reach) * self.width..][..self.width];
            target.fill(0.0);
            for (offset, weight) in kernel.iter().enumerate() {
                let source = &across[(y + offset) * self.width..][..self.width];
                for (value, source) in target.iter_mut().zip(source) {
                    *value += weight * source;
                }
            }
        }
        Self {
            width: self.width,
            height: self.height,
            values,
        }
    }
}

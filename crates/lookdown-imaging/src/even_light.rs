//! Even light for frames without color, as cameras with infrared lamps send them at night: bright
//! below the lamp, dark at the rim, and noisy.

use super::{Frame, buffer_pool::zeros};

/// Most mean difference between the color channels of a frame without color, levels. The least of
/// a colored frame in both development sets is 8.7.
const MAX_COLOR_LEVELS: u64 = 3;
/// Distance of the rows and columns that are read to find color, pixels. Of rows for noise, too.
const COLOR_STEP: usize = 16;
/// Pixels up to this level are surround, masks or unlit, and count for no mean.
const DARK_LEVEL: u8 = 8;
/// Exponent of the ratio of the mean to the local mean; 1 would remove differences of the room
/// itself. Measured in docs/lab/results.md (infrared).
const EVENNESS: f32 = 0.7;
/// Cells along the longer side of a frame for the local means.
const CELLS: u32 = 64;
/// Standard deviation of the Gaussian of the local means, in cells: an eighth of the longer side,
/// several people wide.
const SIGMA_CELLS: u8 = 8;
/// Least share of lit pixels around a cell for a local mean.
const MIN_LIT_SHARE: f32 = 0.05;
/// A Gaussian of .8 pixels against the noise of the sensor, sum 256.
const BLUR: [u32; 5] = [6, 58, 128, 58, 6];
/// The kernel for frames without noise, which lose by a blur.
const NO_BLUR: [u32; 5] = [0, 0, 256, 0, 0];
/// Least median of the second differences of neighbors in a noisy frame, levels. Infrared-like
/// copies of the development sets have 8 and more. Other gray copies have 4 and less, but for one.
const MIN_NOISE_LEVELS: u16 = 6;

/// Returns the frame in even light, and with less noise if it is noisy. Returns `None` for a frame
/// with color, which stays as it is.
pub fn with_even_light(frame: &Frame) -> Option<Frame> {
    (!has_color(frame)).then(|| evened(frame))
}

fn has_color(frame: &Frame) -> bool {
    let (mut sum, mut count) = (0, 0);
    let rows = frame.pixels().chunks_exact(3 * frame.width() as usize);
    for row in rows.step_by(COLOR_STEP) {
        for pixel in row.chunks_exact(3).step_by(COLOR_STEP) {
            let (least, most) = (pixel.iter().min(), pixel.iter().max());
            if let (Some(least), Some(most)) = (least, most)
                && *most > DARK_LEVEL
            {
                sum += u64::from(most - least);
                count += 1;
            }
        }
    }
    sum > MAX_COLOR_LEVELS * count
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "levels and positions in a frame are small, and `as` saturates"
)]
fn evened(frame: &Frame) -> Frame {
    let (width, height) = (frame.width() as usize, frame.height() as usize);
    let gray: Vec<u8> = frame
        .pixels()
        .chunks_exact(3)
        .map(|pixel| pixel[1])
        .collect();
    let cell = frame.width().max(frame.height()).div_ceil(CELLS) as usize;
    let across = width.div_ceil(cell);
    let gains = gains(&gray, width, cell);
    let last = gains.len() / across - 1;
    let blur = if is_noisy(&gray, width) {
        BLUR
    } else {
        NO_BLUR
    };
    // The two nearest cells of a row or column, and the weight of the second.
    let nearest = |at: usize, last: usize| {
        let position = ((at as f32 + 0.5) / cell as f32 - 0.5).clamp(0.0, last as f32);
        let first = position as usize;
        (first, (first + 1).min(last), position - first as f32)
    };
    let columns: Vec<_> = (0..width).map(|x| nearest(x, across - 1)).collect();
    let mut pixels = zeros(3 * width * height);
    let mut sums = vec![0; width + BLUR.len() - 1];
    let mut row_gains = vec![0.0; across];
    for (y, line) in pixels.chunks_exact_mut(3 * width).enumerate() {
        sums.fill(0);
        for (weight, offset) in blur.iter().zip(0..) {
            let row = (y + offset).saturating_sub(BLUR.len() / 2).min(height - 1) * width;
            for (sum, level) in sums[BLUR.len() / 2..]
                .iter_mut()
                .zip(&gray[row..row + width])
            {
                *sum += weight * u32::from(*level);
            }
        }
        let (first, end) = (BLUR.len() / 2, width + BLUR.len() / 2);
        let edges = [sums[first], sums[end - 1]];
        sums[..first].fill(edges[0]);
        sums[end..].fill(edges[1]);
        let (above, below, share) = nearest(y, last);
        for (x, gain) in row_gains.iter_mut().enumerate() {
            let [above, below] = [above, below].map(|row| gains[row * across + x]);
            *gain = above + (below - above) * share;
        }
        let levels = sums.windows(BLUR.len()).zip(&columns);
        for (pixel, (sums, (left, right, share))) in line.chunks_exact_mut(3).zip(levels) {
            let sum: u32 = sums
                .iter()
                .zip(blur)
                .map(|(sum, weight)| sum * weight)
                .sum();
            let gain = row_gains[*left] + (row_gains[*right] - row_gains[*left]) * share;
            pixel.fill((sum as f32 / 65536.0 * gain + 0.5) as u8);
        }
    }
    // The length of the buffer matches the size.
    Frame::new(frame.width(), frame.height(), pixels).unwrap_or_else(|_| frame.clone())
}

/// Returns true if neighbors in half of the lit places differ by noise.
fn is_noisy(gray: &[u8], width: usize) -> bool {
    let (mut noisy, mut lit) = (0, 0);
    for row in gray.chunks_exact(width).step_by(COLOR_STEP) {
        for levels in row.windows(3).filter(|levels| levels[1] > DARK_LEVEL) {
            let [left, middle, right] = [0, 1, 2].map(|at| u16::from(levels[at]));
            noisy += usize::from((left + right).abs_diff(2 * middle) >= MIN_NOISE_LEVELS);
            lit += 1;
        }
    }
    2 * noisy > lit
}

/// Returns the factor of each cell of `cell` pixels, row by row.
fn gains(gray: &[u8], width: usize, cell: usize) -> Vec<f32> {
    let across = width.div_ceil(cell);
    let (mut levels, mut lit) = (Vec::new(), Vec::new());
    for rows in gray.chunks(width * cell) {
        let mut sums = vec![[0_u32; 2]; across];
        for row in rows.chunks_exact(width) {
            for ([sum, count], levels) in sums.iter_mut().zip(row.chunks(cell)) {
                for level in levels.iter().filter(|level| **level > DARK_LEVEL) {
                    *sum += u32::from(*level);
                    *count += 1;
                }
            }
        }
        levels.extend(sums.iter().map(|[sum, _]| *sum as f32));
        lit.extend(sums.iter().map(|[_, count]| *count as f32));
    }
    let mean = levels.iter().sum::<f32>() / lit.iter().sum::<f32>().max(1.0);
    let [levels, lit] = [levels, lit].map(|values| {
        let turned = blurred_and_turned(&values, across);
        blurred_and_turned(&turned, values.len() / across)
    });
    let least = MIN_LIT_SHARE * (cell * cell) as f32;
    let local = levels
        .iter()
        .zip(&lit)
        .map(|(sum, count)| sum / count.max(least));
    let floor = f32::from(DARK_LEVEL);
    local
        .map(|local| (mean.max(floor) / local.max(floor)).powf(EVENNESS))
        .collect()
}

/// Returns the values with a Gaussian along each row, columns as rows.
fn blurred_and_turned(values: &[f32], across: usize) -> Vec<f32> {
    let radius = 3 * usize::from(SIGMA_CELLS);
    let weights: Vec<f32> = (0..=2 * radius)
        .map(|at| (-0.5 * ((at as f32 - radius as f32) / f32::from(SIGMA_CELLS)).powi(2)).exp())
        .collect();
    let mut turned = Vec::with_capacity(values.len());
    for x in 0..across {
        for row in values.chunks_exact(across) {
            let window = &row[x.saturating_sub(radius)..(x + radius + 1).min(across)];
            let weights = &weights[radius.saturating_sub(x)..][..window.len()];
            let products = window
                .iter()
                .zip(weights)
                .map(|(value, weight)| value * weight);
            turned.push(products.sum::<f32>() / weights.iter().sum::<f32>());
        }
    }
    turned
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room of one gray under a lamp, with a dark rim, and with `color` levels more of red.
    fn lit_from_the_middle(color: u8) -> Frame {
        let mut pixels = Vec::new();
        for y in -100..100_i32 {
            for x in -120..120_i32 {
                let level = u8::try_from(180 - (x * x + y * y) / 200).unwrap();
                pixels.extend([level + color, level, level]);
            }
        }
        Frame::new(240, 200, pixels).unwrap()
    }

    #[test]
    fn frames_without_color_are_lit_evenly_and_others_kept() {
        let frame = lit_from_the_middle(0);
        let even = with_even_light(&frame).unwrap();
        let contrast = |frame: &Frame| {
            let [middle, corner] = [(120, 100), (2, 2)].map(|(x, y)| frame.pixel(x, y)[0]);
            f64::from(middle) / f64::from(corner)
        };
        let [before, after] = [&frame, &even].map(contrast);
        assert!(before > 2.5 && after < 0.75 * before, "{before} {after}");
        assert_eq!(with_even_light(&lit_from_the_middle(20)), None);
    }

    #[test]
    fn even_light_is_made_in_frames_of_any_size() {
        for (width, height) in [(1, 1), (1, 300), (300, 1), (65, 64)] {
            for level in [0, 100, 255] {
                let size = 3 * width as usize * height as usize;
                let frame = Frame::new(width, height, vec![level; size]).unwrap();
                let even = with_even_light(&frame).unwrap();
                let differs = |value: &u8| value.abs_diff(level) > 1;
                assert!(
                    !even.pixels().iter().any(differs),
                    "{width} × {height} of {level}"
                );
            }
        }
    }
}

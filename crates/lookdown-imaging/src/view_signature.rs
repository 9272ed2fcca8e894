//! Coarse signature of a rendered view for motion detection.

use super::{
    NetworkInput,
    cell_motion::{MOVED_LEVELS, MovedCell, is_noise},
};

/// Sides of the averaged cells, in view pixels. 256 pixels average out the noise of a sensor and of
/// JPEG, and a detectable person fills a good part of one cell.
const CELL: usize = 16;
/// The planes of a view.
const CHANNELS: usize = 3;

/// Mean levels (0 to 255) of the cells of a view, for each color channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ViewSignature {
    /// Cells in a row.
    across: usize,
    /// The cells of one channel after the other.
    levels: Vec<u8>,
}

impl ViewSignature {
    /// Computes the signature of a view rendered for `input`, from its slot `[3, height, width]`.
    pub fn new(slot: &[f32], input: &NetworkInput) -> Self {
        let (width, height) = (input.width as usize, input.height as usize);
        let (across, down) = (width.div_ceil(CELL), height.div_ceil(CELL));
        let mut levels = Vec::with_capacity(CHANNELS * across * down);
        let planes = slot.chunks_exact(input.plane_len()).zip(&input.scale);
        for ((plane, scale), offset) in planes.zip(&input.offset) {
            for rows in plane.chunks(width * CELL) {
                let mut sums = vec![0.0_f32; across];
                for row in rows.chunks_exact(width) {
                    for (sum, cell) in sums.iter_mut().zip(row.chunks(CELL)) {
                        *sum += cell.iter().sum::<f32>();
                    }
                }
                let tall = rows.len() / width;
                for (column, sum) in sums.into_iter().enumerate() {
                    let wide = CELL.min(width - column * CELL);
                    let mean = sum / (tall * wide) as f32;
                    levels.push(level((mean - offset) / scale));
                }
            }
        }
        Self { across, levels }
    }

    /// Returns true if there is motion between two signatures of the same view, not only noise.
    pub fn differs_from(&self, other: &Self) -> bool {
        if self.across != other.across || self.levels.len() != other.levels.len() {
            return true;
        }
        let count = self.levels.len() / CHANNELS;
        let difference = |index: usize| {
            let channels = (index..self.levels.len()).step_by(count);
            let changes = channels.map(|at| self.levels[at].abs_diff(other.levels[at]));
            changes.max().unwrap_or_default()
        };
        let cells = (0..count).map(|index| MovedCell {
            bounds: self.cell(index),
            levels: difference(index),
        });
        let moved: Vec<_> = cells.filter(|cell| cell.levels >= MOVED_LEVELS).collect();
        !is_noise(&moved)
    }

    fn cell(&self, index: usize) -> [f64; 4] {
        let (x, y) = ((index % self.across) as f64, (index / self.across) as f64);
        [x, y, x + 1.0, y + 1.0].map(|at| at * CELL as f64)
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "`as` saturates to 0 to 255, and a mean of levels is within that range"
)]
fn level(mean: f32) -> u8 {
    mean.round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ChannelOrder;

    fn input() -> NetworkInput {
        NetworkInput {
            width: 40,
            height: 33,
            channel_order: ChannelOrder::Bgr,
            scale: [0.017; 3],
            offset: [-2.1, -2.0, -1.8],
        }
    }

    /// A view of one level with a square of another level.
    fn view(level: f32, square: [usize; 2], side: usize, other: f32) -> ViewSignature {
        let input = input();
        let mut slot = vec![0.0; input.view_len()];
        for (index, value) in slot.iter_mut().enumerate() {
            let (plane, pixel) = (index / input.plane_len(), index % input.plane_len());
            let [x, y] = [pixel % 40, pixel / 40];
            let within = |at: usize, start: usize| (start..start + side).contains(&at);
            let here = within(x, square[0]) && within(y, square[1]);
            *value = if here { other } else { level } * input.scale[plane] + input.offset[plane];
        }
        ViewSignature::new(&slot, &input)
    }

    #[test]
    fn a_small_object_that_comes_or_goes_is_motion_anywhere() {
        let empty = view(100.0, [0, 0], 0, 0.0);
        for corner in [[0, 0], [10, 10], [11, 9], [30, 23], [30, 0]] {
            let person = view(100.0, corner, 10, 160.0);
            assert!(empty.differs_from(&person) && person.differs_from(&empty));
        }
    }

    #[test]
    fn a_weak_cell_alone_is_noise_and_with_another_is_motion() {
        let still = view(100.0, [0, 0], 0, 0.0);
        assert!(!still.differs_from(&view(100.0, [0, 0], 16, 105.0)));
        assert!(still.differs_from(&view(100.0, [0, 0], 16, 110.0)));
        assert!(still.differs_from(&view(100.0, [0, 0], 32, 105.0)));
    }

    #[test]
    fn a_flicker_of_the_light_is_no_motion() {
        let (dark, light) = (view(100.0, [0, 0], 0, 0.0), view(103.0, [0, 0], 0, 0.0));
        assert!(!dark.differs_from(&light));
        assert!(dark.differs_from(&view(104.0, [0, 0], 0, 0.0)));
    }
}

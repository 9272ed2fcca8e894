//! Coarse signature of a rendered view for motion detection.

use super::NetworkInput;

/// Sides of the averaged cells, in view pixels. 256 pixels average out the noise of a sensor and of
/// JPEG, and a detectable person fills a good part of one cell.
const CELL: usize = 16;
/// Least change of a cell's mean, in gray levels (0 to 255), that counts as motion. The noise of a
/// mean is below 1. A person's clothes differ from the floor by tens.
pub(super) const MOVED_LEVELS: u8 = 4;

/// Mean levels (0 to 255) of the cells of a view, for each color channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ViewSignature(Vec<u8>);

impl ViewSignature {
    /// Computes the signature of a view rendered for `input`, from its slot `[3, height, width]`.
    #[must_use]
    pub fn of(slot: &[f32], input: &NetworkInput) -> Self {
        let (width, height) = (input.width as usize, input.height as usize);
        let (across, down) = (width.div_ceil(CELL), height.div_ceil(CELL));
        let mut levels = Vec::with_capacity(3 * across * down);
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
                    #[expect(clippy::cast_precision_loss, reason = "at most 256")]
                    let mean = sum / (tall * wide) as f32;
                    levels.push(level((mean - offset) / scale));
                }
            }
        }
        Self(levels)
    }

    /// Returns true if there is motion between two signatures of the same view.
    #[must_use]
    pub fn differs_from(&self, other: &Self) -> bool {
        let mut pairs = self.0.iter().zip(&other.0);
        self.0.len() != other.0.len() || pairs.any(|(a, b)| a.abs_diff(*b) >= MOVED_LEVELS)
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
    use crate::imaging::ChannelOrder;

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
        ViewSignature::of(&slot, &input)
    }

    #[test]
    fn a_small_object_that_comes_or_goes_is_motion_anywhere() {
        let empty = view(100.0, [0, 0], 0, 0.0);
        for corner in [[0, 0], [10, 10], [34, 27], [36, 0]] {
            let person = view(100.0, corner, 6, 160.0);
            assert!(empty.differs_from(&person) && person.differs_from(&empty));
        }
    }

    #[test]
    fn a_flicker_of_the_light_is_no_motion() {
        let (dark, light) = (view(100.0, [0, 0], 0, 0.0), view(103.0, [0, 0], 0, 0.0));
        assert!(!dark.differs_from(&light));
        assert!(dark.differs_from(&view(104.0, [0, 0], 0, 0.0)));
    }
}

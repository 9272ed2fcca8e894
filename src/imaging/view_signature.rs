//! What a rendered view looks like from afar: enough to tell that nothing has moved in it.

use super::NetworkInput;

/// Sides of the cells that are averaged, view pixels: 256 pixels hide the noise of a sensor and of
/// JPEG, and a person who can be found at all fills a good part of one.
const CELL: usize = 16;
/// The change of a cell's mean, in grey levels (0 to 255), from which on something has moved. The
/// noise of a mean is below 1; a person's clothes differ from the floor by tens.
const MOVED_LEVELS: u8 = 4;

/// Mean levels (0 to 255) of the cells of a view, for each colour.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ViewSignature(Vec<u8>);

impl ViewSignature {
    /// The signature of a view rendered for `input`: its slot `[3, height, width]`.
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

    /// Whether something has moved between the two, which are of one view.
    #[must_use]
    pub fn differs_from(&self, other: &Self) -> bool {
        let mut pairs = self.0.iter().zip(&other.0);
        self.0.len() != other.0.len() || pairs.any(|(a, b)| a.abs_diff(*b) >= MOVED_LEVELS)
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "`as` keeps within 0 to 255, and a mean of levels is within them anyway"
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

    /// A view of one level but for a square of another one.
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
    fn something_small_that_comes_or_goes_is_motion_wherever_it_is() {
        let empty = view(100.0, [0, 0], 0, 0.0);
        for corner in [[0, 0], [10, 10], [34, 27], [36, 0]] {
            let somebody = view(100.0, corner, 6, 160.0);
            assert!(empty.differs_from(&somebody) && somebody.differs_from(&empty));
        }
    }

    #[test]
    fn a_flicker_of_the_light_is_no_motion() {
        let (dark, light) = (view(100.0, [0, 0], 0, 0.0), view(103.0, [0, 0], 0, 0.0));
        assert!(!dark.differs_from(&light));
        assert!(dark.differs_from(&view(104.0, [0, 0], 0, 0.0)));
    }
}

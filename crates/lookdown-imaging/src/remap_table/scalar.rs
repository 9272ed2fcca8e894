//! Sampling one pixel at a time, on every machine.

use super::{
    band::{Band, Block, Lanes, Seen},
    block_size::LANES,
    rendering::{Planes, Source, Values, WEIGHT_ONE, render_band},
};

/// Four neighbors of a position in the frame and their weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    /// The upper left neighbor's index, row by row.
    first_pixel: usize,
    /// Weight of the right neighbors, as a part of [`WEIGHT_ONE`].
    right_weight: i32,
    /// Weight of the lower neighbors, 0 to 1.
    lower_weight: f32,
}

pub(super) fn render(source: &Source, band: &Band, planes: Planes) {
    let locate = |block: &Block, seen| {
        let lanes = match seen {
            Seen::Whole => Lanes::MAX,
            Seen::Lanes(lanes) => lanes,
        };
        block.samples(lanes, source.width, source.height)
    };
    let sample = |samples: &_, _| sample_block(source, samples);
    render_band(source, band, planes, locate, sample, |_| {});
}

impl Block {
    /// The samples of its pixels, each `None` where nothing is seen.
    pub(super) fn samples(
        &self,
        lanes: Lanes,
        width: usize,
        height: usize,
    ) -> [Option<Sample>; LANES] {
        std::array::from_fn(|lane| {
            let is_visible = lanes >> lane & 1 == 1;
            is_visible
                .then(|| Sample::at(self.position(lane), width, height))
                .flatten()
        })
    }

    /// The position in the frame (pixel centers) that one of its pixels samples.
    pub(super) fn position(&self, lane: usize) -> [f32; 2] {
        let lane = lane as f32;
        [0, 1].map(|axis| self.start[axis] + self.step[axis] * lane)
    }
}

fn sample_block(source: &Source, samples: &[Option<Sample>; LANES]) -> Values {
    [0, 1, 2].map(|channel| {
        samples.map(|sample| {
            let sum = sample.map_or(0.0, |sample| sample.weighted_sum(source, channel));
            sum * source.scale[channel] + source.offset[channel]
        })
    })
}

impl Sample {
    /// The sample at a position (pixel centers) in a frame of `width` × `height` pixels, both at
    /// least 2; `None` outside. Within the outer half of a border pixel its center is sampled.
    fn at([x, y]: [f32; 2], width: usize, height: usize) -> Option<Self> {
        let (left, right_weight) = split(x, width)?;
        let (top, lower_weight) = split(y, height)?;
        #[expect(clippy::cast_possible_truncation, reason = "at most WEIGHT_ONE")]
        let right_weight = (right_weight * f32::from(WEIGHT_ONE)) as i32;
        Some(Self {
            first_pixel: top * width + left,
            right_weight,
            lower_weight,
        })
    }

    /// Column and row of its four neighbors.
    pub(super) fn neighbors(&self, width: usize) -> impl Iterator<Item = [u32; 2]> {
        let upper_left = [self.first_pixel % width, self.first_pixel / width];
        #[expect(clippy::cast_possible_truncation, reason = "a frame's sides are u32")]
        let [left, top] = upper_left.map(|index| index as u32);
        [[0, 0], [1, 0], [0, 1], [1, 1]]
            .into_iter()
            .map(move |[right, down]| [left + right, top + down])
    }

    /// One channel, in units of `1 / WEIGHT_ONE`.
    fn weighted_sum(&self, source: &Source, channel: usize) -> f32 {
        let mix = |pixel: usize| {
            let [left, right] =
                [0, 3].map(|next| i32::from(source.pixels[3 * pixel + channel + next]));
            (left * (i32::from(WEIGHT_ONE) - self.right_weight) + right * self.right_weight) as f32
        };
        let above = mix(self.first_pixel);
        above + (mix(self.first_pixel + source.width) - above) * self.lower_weight
    }
}

/// The lower neighbor of `position` among `count` pixels and the weight of the upper one. The
/// last pixel is reached with full weight from its neighbor, so both always exist.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the frame first; a frame's side is far below 2^24"
)]
fn split(position: f32, count: usize) -> Option<(usize, f32)> {
    let within = position.clamp(0.0, (count - 1) as f32);
    // Not so where it is not a number either.
    let is_inside = (position - within).abs() <= 0.5;
    let lower = (within as usize).min(count - 2);
    is_inside.then_some((lower, within - lower as f32))
}

//! Rows of a view while they are rendered, eight pixels at a time.

use super::{
    node_grid::{NODE_STEP, Places},
    visibility::RowVisibility,
};
use crate::imaging::{Frame, NetworkInput};

/// Pixels rendered at once: from node to node.
pub(super) const LANES: usize = NODE_STEP as usize;

/// Weights of right neighbours are whole fractions of this: with pixels of eight bits, a product
/// of 16-bit numbers loses nothing.
pub(super) const WEIGHT_ONE: i16 = 1 << 14;

/// What is sampled, and what becomes of the samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Source<'a> {
    /// R, G, B of the frame's pixels, row by row.
    pub(super) pixels: &'a [u8],
    pub(super) width: usize,
    pub(super) height: usize,
    /// For red, green and blue: factor for samples in units of `1 / WEIGHT_ONE`.
    pub(super) scale: [f32; 3],
    /// For red, green and blue: added to the scaled sample; what hidden pixels become.
    pub(super) offset: [f32; 3],
}

/// A row's nodes in pixels of the frame, and which of its pixels see anything.
pub(super) struct Row<'a> {
    pub(super) nodes: &'a Places,
    pub(super) visibility: RowVisibility,
}

/// Eight pixels between two nodes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// Where the first one samples.
    pub(super) start: [f32; 2],
    /// From one to the next.
    pub(super) step: [f32; 2],
}

/// Which pixels of a block see the lens image, the first one in the lowest bit.
pub(super) type Lanes = u8;

/// Where red, green and blue go to.
pub(super) type Planes<'a> = [&'a mut [f32]; 3];

/// Red, green and blue of one block.
pub(super) type Values = [[f32; LANES]; 3];

impl<'a> Source<'a> {
    pub(super) fn new(frame: &'a Frame, input: &NetworkInput) -> Self {
        let mut source = Self {
            pixels: frame.pixels(),
            width: frame.width() as usize,
            height: frame.height() as usize,
            scale: [0.0; 3],
            offset: [0.0; 3],
        };
        for (plane, channel) in input.source_channels().into_iter().enumerate() {
            source.scale[channel] = input.scale[plane] / f32::from(WEIGHT_ONE);
            source.offset[channel] = input.offset[plane];
        }
        source
    }
}

impl Row<'_> {
    /// The block from pixel `LANES · index`.
    #[inline]
    pub(super) fn block(&self, index: usize) -> Block {
        let [(x, x_step), (y, y_step)] = [&self.nodes.x, &self.nodes.y].map(|nodes| {
            #[expect(clippy::cast_precision_loss, reason = "it is 8")]
            let step = (nodes[index + 1] - nodes[index]) * (1.0 / LANES as f32);
            (nodes[index], step)
        });
        Block {
            start: [x, y],
            step: [x_step, y_step],
        }
    }

    /// Which pixels of that block see the lens image.
    #[inline]
    pub(super) fn lanes(&self, index: usize) -> Lanes {
        #[expect(clippy::cast_possible_truncation, reason = "a view's width is a u32")]
        let first_pixel = (index * LANES) as u32;
        self.visibility.lanes(first_pixel)
    }
}

/// Renders some rows, at most as many as a block has pixels, into `planes`, each of which holds as
/// many rows: block by block, each in all rows, so that what they sample lies close together. Of all
/// these blocks it is found out first where they sample (`locate`, of a block and those of its pixels
/// that see the lens image; it is not asked where none does), so that the processor need not wait for
/// one before it begins with the next. `sample` gets that and the row's index.
#[expect(
    clippy::inline_always,
    reason = "`locate` and `sample` become vector code only within a function that may use it"
)]
#[inline(always)]
pub(super) fn render_band<Samples>(
    source: &Source,
    rows: &[Row],
    planes: Planes,
    locate: impl Fn(&Block, Lanes) -> Samples,
    sample: impl Fn(&Samples, usize) -> Values,
) {
    let [red, green, blue] = planes;
    let width = red.len() / rows.len();
    for (index, first_pixel) in (0..width).step_by(LANES).enumerate() {
        let count = LANES.min(width - first_pixel);
        let samples: [Option<Samples>; LANES] = std::array::from_fn(|y| {
            let row = rows.get(y)?;
            let lanes = row.lanes(index);
            (lanes != 0).then(|| locate(&row.block(index), lanes))
        });
        for (y, samples) in samples.iter().enumerate().take(rows.len()) {
            let [reds, greens, blues] = match samples {
                Some(samples) => sample(samples, y),
                None => source.offset.map(|value| [value; LANES]),
            };
            let start = y * width + first_pixel;
            let pixels = start..start + count;
            write(&mut red[pixels.clone()], &reds);
            write(&mut green[pixels.clone()], &greens);
            write(&mut blue[pixels], &blues);
        }
    }
}

/// The last block of a row may reach beyond it.
#[inline]
fn write(pixels: &mut [f32], values: &[f32; LANES]) {
    match pixels.first_chunk_mut() {
        Some(block) => *block = *values,
        None => pixels.copy_from_slice(&values[..pixels.len()]),
    }
}

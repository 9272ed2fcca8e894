//! One row of a view while it is rendered, eight pixels at a time.

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
    /// Which of them see the lens image, the first one in the lowest bit.
    pub(super) lanes: u8,
}

/// One output per channel.
pub(super) type Outputs<'a, T> = [&'a mut T; 3];

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
        #[expect(clippy::cast_possible_truncation, reason = "a view's width is a u32")]
        let first_pixel = (index * LANES) as u32;
        Block {
            start: [x, y],
            step: [x_step, y_step],
            lanes: self.visibility.lanes(first_pixel),
        }
    }

    /// Renders the row into `planes`, each as long as the view is wide: `sample` makes the values of
    /// one block, and is not asked where nothing is visible.
    #[expect(
        clippy::inline_always,
        reason = "`sample` becomes vector code only within a function that may use it"
    )]
    #[inline(always)]
    pub(super) fn render(
        &self,
        source: &Source,
        planes: Outputs<[f32]>,
        sample: impl Fn(&Source, &Block, Outputs<[f32; LANES]>),
    ) {
        let [red, green, blue] = planes.map(|plane| plane.as_chunks_mut::<LANES>());
        let whole_blocks = red.0.len();
        let render_block = |index: usize, [red, green, blue]: Outputs<[f32; LANES]>| {
            let block = self.block(index);
            if block.lanes == 0 {
                let [of_red, of_green, of_blue] = source.offset;
                red.fill(of_red);
                green.fill(of_green);
                blue.fill(of_blue);
            } else {
                sample(source, &block, [red, green, blue]);
            }
        };
        let outputs = red.0.iter_mut().zip(green.0).zip(blue.0);
        for (index, ((red, green), blue)) in outputs.enumerate() {
            render_block(index, [red, green, blue]);
        }
        let rest = [red.1, green.1, blue.1];
        if !rest[0].is_empty() {
            let mut values = [[0.0; LANES]; 3];
            let [red, green, blue] = &mut values;
            render_block(whole_blocks, [red, green, blue]);
            for (plane, values) in rest.into_iter().zip(values) {
                plane.copy_from_slice(&values[..plane.len()]);
            }
        }
    }
}

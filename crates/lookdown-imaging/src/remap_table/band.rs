//! Bands of a view while they are rendered: eight rows between two rows of nodes.

#![expect(
    clippy::inline_always,
    reason = "these become vector code only within a function that may use it"
)]

use std::{array, ops::Range};

use super::{
    block_size::LANES, frame_from_plane::FrameFromPlane, node_grid::Nodes, visibility::Visibility,
};

/// Vertical position of each row of pixels between two rows of nodes, 0 to 1.
const DOWN: [f32; LANES] = [0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875];

/// Eight rows of a view.
pub(super) struct Band<'a> {
    pub(super) above: Nodes<'a>,
    pub(super) below: Nodes<'a>,
    pub(super) frame_from_plane: &'a FrameFromPlane,
    pub(super) visibility: &'a Visibility,
    /// The view's rows that it has: the last band may reach beyond the view.
    pub(super) rows: Range<usize>,
    /// Those of its patches of which all pixels see the lens image, within the frame.
    pub(super) whole_patches: Range<usize>,
}

/// 8×8 pixels between four nodes.
pub(super) struct Patch {
    /// Position in the frame that the first pixel of each row samples: columns, then rows.
    start: [[f32; LANES]; 2],
    /// Step from one pixel to the next, for each row.
    step: [[f32; LANES]; 2],
}

/// Eight pixels, a row of a patch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// Position in the frame that the first pixel samples.
    pub(super) start: [f32; 2],
    /// Step from one pixel to the next.
    pub(super) step: [f32; 2],
}

/// Bit mask of the pixels of a block that show the lens image, the first one in the lowest bit.
pub(super) type Lanes = u8;

/// Visibility of a block, known before it is sampled.
#[derive(Debug, Clone, Copy)]
pub(super) enum Seen {
    /// All of its pixels see the lens image, within the frame.
    Whole,
    /// These see the lens image.
    Lanes(Lanes),
}

impl Band<'_> {
    /// Number of patches.
    pub(super) fn patches(&self) -> usize {
        self.above.x.len() - 1
    }

    /// One of its patches, from the left.
    #[inline(always)]
    pub(super) fn patch(&self, index: usize) -> Patch {
        let (start, end) = (self.edge(index), self.edge(index + 1));
        let step = |axis: usize| -> [f32; LANES] {
            array::from_fn(|row| (end[axis][row] - start[axis][row]) * DOWN[1])
        };
        Patch {
            start,
            step: [step(0), step(1)],
        }
    }

    /// The pixels of a row of a patch that show the lens image.
    #[inline]
    pub(super) fn lanes(&self, row: usize, patch: usize) -> Lanes {
        #[expect(clippy::cast_possible_truncation, reason = "a view's width is a u32")]
        let first_pixel = (patch * LANES) as u32;
        let row = self.visibility.row(self.rows.start + row);
        row.lanes(first_pixel)
    }

    /// The position in the frame that each row samples between the nodes of a column: columns, then
    /// rows.
    #[inline(always)]
    fn edge(&self, column: usize) -> [[f32; LANES]; 2] {
        let [x, y] = [
            (self.above.x[column], self.below.x[column]),
            (self.above.y[column], self.below.y[column]),
        ]
        .map(|(above, below)| DOWN.map(|down| above + (below - above) * down));
        self.frame_from_plane.pixels_at(&x, &y)
    }
}

impl Patch {
    /// One of its rows.
    #[inline(always)]
    pub(super) fn block(&self, row: usize) -> Block {
        Block {
            start: [0, 1].map(|axis| self.start[axis][row]),
            step: [0, 1].map(|axis| self.step[axis][row]),
        }
    }
}

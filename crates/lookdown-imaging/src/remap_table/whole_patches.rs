//! Patches of a view that need no checks while they are rendered.

use std::ops::Range;

use super::{frame_from_plane::FrameFromPlane, node_grid::NodeGrid};

/// For each band of a view, the longest run of patches whose pixels all show the lens image, a
/// pixel or more from the frame's borders.
#[derive(Debug, Clone)]
pub(super) struct WholePatches {
    bands: Vec<[u32; 2]>,
}

impl WholePatches {
    pub(super) fn new(
        grid: &NodeGrid,
        frame_from_plane: &FrameFromPlane,
        frame_width: u32,
        frame_height: u32,
    ) -> Self {
        let within = |place: f32, count: u32| (1.0..=count as f32 - 2.0).contains(&place);
        let node_is_within = |row: usize, column: usize| {
            let nodes = grid.nodes(row);
            let [x, y] = frame_from_plane.pixel_at([nodes.x[column], nodes.y[column]]);
            within(x, frame_width) && within(y, frame_height)
        };
        #[expect(clippy::cast_possible_truncation, reason = "a view's width is a u32")]
        let patches = grid.patches_across() as u32;
        let visibility = grid.visibility();
        let band = |band: usize| {
            let rows = visibility.rows_of_band(band);
            let is_whole = |patch: u32| {
                let column = patch as usize;
                let corners = [
                    (band, column),
                    (band, column + 1),
                    (band + 1, column),
                    (band + 1, column + 1),
                ];
                corners
                    .iter()
                    .all(|&(row, column)| node_is_within(row, column))
                    && rows
                        .clone()
                        .all(|row| visibility.row(row).lanes(8 * patch) == u8::MAX)
            };
            longest_run(patches, is_whole)
        };
        Self {
            bands: (0..visibility.bands()).map(band).collect(),
        }
    }

    pub(super) fn band(&self, index: usize) -> Range<usize> {
        let [start, end] = self.bands[index].map(|patch| patch as usize);
        start..end
    }

    /// Memory held, bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.bands.as_slice())
    }
}

/// Start and end of the longest run of numbers below `count` for which `holds`.
fn longest_run(count: u32, holds: impl Fn(u32) -> bool) -> [u32; 2] {
    let mut longest = [0, 0];
    let mut start = 0;
    for number in 0..count {
        if !holds(number) {
            start = number + 1;
        } else if number + 1 - start > longest[1] - longest[0] {
            longest = [start, number + 1];
        }
    }
    longest
}

//! Node grids: where in the lens's normalised plane a view samples, at every eighth pixel.

use super::visibility::Visibility;
use crate::geometry::{Lens, Pixel, VirtualView};

/// Positions are exact at every so many view pixels, across and down.
pub(super) const NODE_STEP: u32 = 8;

/// One view's nodes. Blocks of 8×8 pixels lie between them, the last ones beyond the view's right
/// and lower border where its sides are no multiples of 8.
#[derive(Debug)]
pub(super) struct NodeGrid {
    /// Row by row.
    nodes: Places,
    nodes_across: usize,
    visibility: Visibility,
}

/// Positions, in the normalised plane or in the frame, coordinate by coordinate.
#[derive(Debug, Default)]
pub(super) struct Places {
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
}

impl NodeGrid {
    pub(super) fn new(view: &VirtualView, lens: &Lens) -> Self {
        let blocks_across = view.width().div_ceil(NODE_STEP);
        let blocks_down = view.height().div_ceil(NODE_STEP);
        let mut nodes = Places::default();
        for row in 0..=blocks_down {
            for column in 0..=blocks_across {
                let pixel = Pixel::new(f64::from(column * NODE_STEP), f64::from(row * NODE_STEP));
                let place = lens.continued_beyond_rim(&view.ray_in_camera(&pixel));
                // A node without a place hides the four blocks around it.
                let place = place.unwrap_or(Pixel::new(f64::NAN, f64::NAN));
                nodes.x.push(single(place.x));
                nodes.y.push(single(place.y));
            }
        }
        Self {
            nodes,
            nodes_across: blocks_across as usize + 1,
            visibility: Visibility::new(view, lens),
        }
    }

    /// What lies between the nodes above and below the view's row `y`: one place per node, passed
    /// through `transformed` and put into `places`.
    pub(super) fn along_row(
        &self,
        y: usize,
        transformed: impl Fn([f32; 2]) -> [f32; 2],
        places: &mut Places,
    ) {
        let step = NODE_STEP as usize;
        #[expect(clippy::cast_precision_loss, reason = "below 8")]
        let down = (y % step) as f32 / NODE_STEP as f32;
        let upper = y / step * self.nodes_across;
        let lower = upper + self.nodes_across;
        let end = lower + self.nodes_across;
        // One thing at a time, each in a loop that becomes vector code.
        let between = |coordinates: &[f32], places: &mut Vec<f32>| {
            let pairs = coordinates[upper..lower]
                .iter()
                .zip(&coordinates[lower..end]);
            places.clear();
            places.extend(pairs.map(|(above, below)| above + (below - above) * down));
        };
        between(&self.nodes.x, &mut places.x);
        between(&self.nodes.y, &mut places.y);
        for (x, y) in places.x.iter_mut().zip(&mut places.y) {
            [*x, *y] = transformed([*x, *y]);
        }
    }

    /// Which pixels see the lens image.
    pub(super) fn visibility(&self) -> &Visibility {
        &self.visibility
    }

    /// Memory held, bytes.
    pub(super) fn bytes(&self) -> usize {
        let coordinates = [self.nodes.x.as_slice(), self.nodes.y.as_slice()];
        size_of::<Self>()
            + coordinates.map(size_of_val).iter().sum::<usize>()
            + self.visibility.bytes()
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "24 bits tell 1/1000 of a pixel in a frame of 8000"
)]
fn single(coordinate: f64) -> f32 {
    coordinate as f32
}

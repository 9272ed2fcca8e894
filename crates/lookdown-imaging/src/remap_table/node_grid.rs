//! Node grids: where a view samples, at every eighth pixel: in the lens's normalized plane, or, of
//! a frame crop, in the frame.

use lookdown_lens::geometry::{
    FrameCrop, Lens, Panorama, Pixel, VirtualView,
    pixels::{to_corner_origin, to_pixel_center},
};

use super::{block_size::NODE_STEP, visibility::Visibility};

/// One view's nodes. Patches of 8×8 pixels lie between them, the last ones beyond the view's right
/// and lower border where its sides are not multiples of 8.
#[derive(Debug)]
pub(super) struct NodeGrid {
    /// Row by row.
    x: Vec<f32>,
    y: Vec<f32>,
    nodes_across: usize,
    /// The pixels that show the lens image.
    pub(super) visibility: Visibility,
}

/// A row of nodes: places in the normalized plane, coordinate by coordinate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nodes<'a> {
    pub(super) x: &'a [f32],
    pub(super) y: &'a [f32],
}

impl NodeGrid {
    pub(super) fn new(view: &VirtualView, lens: &Lens) -> Self {
        let size = [view.width, view.height];
        Self::from_positions(size, Visibility::new(view, lens), |pixel| {
            let place = lens.continued_beyond_rim(&view.ray_in_camera(pixel));
            // A node without a place hides the four patches around it.
            place.unwrap_or(Pixel::new(f64::NAN, f64::NAN))
        })
    }

    /// The nodes of a panorama. Those beyond the lens image have no place.
    pub(super) fn for_panorama(panorama: &Panorama, lens: &Lens) -> Self {
        let size = [panorama.width, panorama.height];
        Self::from_positions(size, Visibility::everywhere(size), |pixel| {
            let ray = panorama.ray_in_camera(pixel);
            let place = lens.project(&ray).and(lens.continued_beyond_rim(&ray));
            place.unwrap_or(Pixel::new(f64::NAN, f64::NAN))
        })
    }

    /// The nodes of a crop, in pixels of the frame (pixel centers).
    pub(super) fn for_crop(crop: &FrameCrop) -> Self {
        let size = [crop.width, crop.height];
        Self::from_positions(size, Visibility::everywhere(size), |pixel| {
            let position = to_corner_origin(*pixel);
            let position = crop.frame_from_crop(&position);
            to_pixel_center(position)
        })
    }

    fn from_positions(
        [width, height]: [u32; 2],
        visibility: Visibility,
        position: impl Fn(&Pixel) -> Pixel,
    ) -> Self {
        let (patches_across, patches_down) =
            (width.div_ceil(NODE_STEP), height.div_ceil(NODE_STEP));
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for row in 0..=patches_down {
            for column in 0..=patches_across {
                let pixel = Pixel::new(f64::from(column * NODE_STEP), f64::from(row * NODE_STEP));
                let place = position(&pixel);
                x.push(single(place.x));
                y.push(single(place.y));
            }
        }
        Self {
            x,
            y,
            nodes_across: patches_across as usize + 1,
            visibility,
        }
    }

    /// The nodes of a row, from the top.
    pub(super) fn nodes(&self, row: usize) -> Nodes<'_> {
        let row = row * self.nodes_across..(row + 1) * self.nodes_across;
        Nodes {
            x: &self.x[row.clone()],
            y: &self.y[row],
        }
    }

    /// Patches in a row.
    pub(super) fn patches_across(&self) -> usize {
        self.nodes_across - 1
    }

    /// Memory held, bytes.
    pub(super) fn bytes(&self) -> usize {
        let coordinates = [self.x.as_slice(), self.y.as_slice()];
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

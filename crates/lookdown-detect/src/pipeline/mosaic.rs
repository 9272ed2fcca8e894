//! Mosaics: several small crops of a frame in one input of the network.

use std::ops::Range;

use lookdown_lens::geometry::FrameCrop;

use crate::{detection::BBox, inference::ViewDetection};
use lookdown_imaging::{Frame, NetworkInput, RemapTable};

/// Crops in as few inputs of the network as possible: one that fills an input, or several side by
/// side, row by row.
#[derive(Debug)]
pub(super) struct Mosaics {
    /// The crops.
    pub(super) crops: Vec<(FrameCrop, RemapTable)>,
    /// The crops of each input.
    inputs: Vec<Range<usize>>,
    /// The side of the square that the crops of an input share, pixels.
    side: u32,
}

impl Mosaics {
    /// Distributes crops to squares of `side` pixels. Only neighbors of the same size share one.
    pub(super) fn new(side: u32, crops: Vec<(FrameCrop, RemapTable)>) -> Self {
        let mut inputs = Vec::new();
        let mut first = 0;
        for alike in crops.chunk_by(|(one, _), (other, _)| one.width == other.width) {
            let per_side = (side / alike[0].0.width).max(1) as usize;
            for tiles in alike.chunks(per_side * per_side) {
                inputs.push(first..first + tiles.len());
                first += tiles.len();
            }
        }
        Self {
            crops,
            inputs,
            side,
        }
    }

    /// Returns the crops of each input.
    pub(super) fn inputs(&self) -> impl ExactSizeIterator<Item = &[(FrameCrop, RemapTable)]> {
        self.inputs.iter().map(|tiles| &self.crops[tiles.clone()])
    }

    /// Renders the tiles of an input into its slot `[3, height, width]`. Places without a tile are
    /// black.
    pub(super) fn render(
        &self,
        number: usize,
        frame: &Frame,
        input: &NetworkInput,
        slot: &mut [f32],
    ) {
        let tiles = &self.crops[self.inputs[number].clone()];
        if let [(crop, table)] = tiles
            && (crop.width, crop.height) == (input.width, input.height)
        {
            return table.render(frame, input, slot);
        }
        for (plane, offset) in slot.chunks_exact_mut(input.plane_len()).zip(input.offset) {
            plane.fill(offset);
        }
        let mut pixels = Vec::new();
        for (index, (crop, table)) in tiles.iter().enumerate() {
            let tile = NetworkInput {
                width: crop.width,
                height: crop.height,
                ..input.clone()
            };
            pixels.resize(tile.view_len(), 0.0);
            table.render(frame, &tile, &mut pixels);
            let [left, top] = self.corner(index, crop).map(|at| at as usize);
            let (wide, across) = (crop.width as usize, input.width as usize);
            let planes = slot.chunks_exact_mut(input.plane_len());
            for (plane, source) in planes.zip(pixels.chunks_exact(tile.plane_len())) {
                let rows = plane[top * across..].chunks_mut(across);
                for (row, source) in rows.zip(source.chunks_exact(wide)) {
                    row[left..left + wide].copy_from_slice(source);
                }
            }
        }
    }

    /// Divides the detections in each input into those of each crop, in pixels of the crop. A tile
    /// has the boxes whose middle it holds, cut off at its border.
    pub(super) fn per_crop(&self, per_input: Vec<Vec<ViewDetection>>) -> Vec<Vec<ViewDetection>> {
        let mut per_crop = Vec::with_capacity(self.crops.len());
        for (tiles, found) in self.inputs().zip(per_input) {
            for (index, (crop, _)) in tiles.iter().enumerate() {
                let corner = self.corner(index, crop).map(f64::from);
                let inside = found.iter().filter_map(|found| within(found, crop, corner));
                per_crop.push(inside.collect());
            }
        }
        per_crop
    }

    /// Returns the left upper corner of a tile in its input, pixels.
    fn corner(&self, index: usize, crop: &FrameCrop) -> [u32; 2] {
        // There are nine tiles at most.
        let index = u32::try_from(index).unwrap_or_default();
        let per_side = (self.side / crop.width).max(1);
        [
            index % per_side * crop.width,
            index / per_side * crop.height,
        ]
    }
}

/// Returns a detection in an input as one in the tile at `corner`; `None` if its middle is
/// elsewhere.
fn within(found: &ViewDetection, crop: &FrameCrop, corner: [f64; 2]) -> Option<ViewDetection> {
    let size = [crop.width, crop.height].map(f64::from);
    let center = found.bbox.center();
    let is_within = [0, 1].map(|axis| (0.0..size[axis]).contains(&(center[axis] - corner[axis])));
    let corners = found.bbox.corners();
    let local = [0, 1, 2, 3].map(|side| {
        let axis = side % 2;
        (corners[side] - corner[axis]).clamp(0.0, size[axis])
    });
    let bbox = BBox::new(local).ok()?;
    (is_within == [true, true]).then_some(ViewDetection { bbox, ..*found })
}

#[cfg(test)]
mod tests {
    use lookdown_lens::geometry::{Pixel, QuarterTurn};

    use super::*;

    /// A crop of 40 × 40 pixels of the frame at its own scale.
    fn crop(x: f64, y: f64) -> FrameCrop {
        FrameCrop {
            is_mirrored: false,
            turn: QuarterTurn::None,
            center: Pixel::new(x, y),
            scale: 1.0,
            width: 40,
            height: 40,
        }
    }

    #[test]
    fn boxes_of_tiles_are_boxes_of_their_crops() {
        // Red grows with x, green with y.
        let pixels = (0..200).flat_map(|y| (0..200).flat_map(move |x| [x, y, 0]));
        let frame = Frame::new(200, 200, pixels.collect()).unwrap();
        let crops = [
            [50.0, 50.0],
            [100.0, 60.0],
            [70.0, 150.0],
            [150.0, 90.0],
            [40.0, 40.0],
        ];
        let crops = crops.map(|[x, y]| crop(x, y));
        let tables = crops.map(|crop| RemapTable::for_crop(&crop, 200, 200));
        let crops: Vec<_> = crops.into_iter().zip(tables).collect();
        let mosaics = Mosaics::new(80, crops.clone());
        assert_eq!(mosaics.inputs().len(), 2);
        let input = NetworkInput::plain(80, 80);
        let mut slot = vec![0.0; input.view_len()];
        mosaics.render(0, &frame, &input, &mut slot);
        let corners = [(5_u32, 5_u32), (45, 5), (5, 45), (45, 45)];
        let found = |(left, top): (u32, u32)| ViewDetection {
            posture: None,
            bbox: BBox::new([left, top, left + 20, top + 20].map(f64::from)).unwrap(),
            score: 0.5,
        };
        // No tile is at the last one.
        let found = vec![corners.map(found).to_vec(), vec![found((45, 5))]];
        let per_crop = mosaics.per_crop(found);
        for (number, (left, top)) in corners.into_iter().enumerate() {
            let [local] = per_crop[number][..] else {
                panic!("{per_crop:?}");
            };
            let [x, y, ..] = mosaics.crops[number].0.frame_box(local.bbox.corners());
            let index = top as usize * 80 + left as usize;
            let shown = [slot[index], slot[input.plane_len() + index]].map(f64::from);
            assert!((shown[0] - x).abs() < 0.6 && (shown[1] - y).abs() < 0.6);
        }
        assert_eq!(per_crop[4], []);
        assert_eq!(Mosaics::new(120, crops.clone()).inputs().len(), 1);
        assert_eq!(Mosaics::new(40, crops).inputs().len(), 5);
    }
}

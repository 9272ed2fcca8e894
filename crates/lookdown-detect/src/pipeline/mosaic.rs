//! Mosaics: several small crops of a frame in one input of the network.

use lookdown_lens::geometry::FrameCrop;

use crate::{
    detection::{BBox, ViewPixels},
    imaging::{Frame, NetworkInput, RemapTable},
};

/// Tiles along each side of an input.
pub(super) const TILES_PER_SIDE: u32 = 2;
/// Tiles of an input.
const TILES: usize = (TILES_PER_SIDE * TILES_PER_SIDE) as usize;

/// Up to four crops side by side, row by row.
#[derive(Debug)]
pub(super) struct Mosaic(Vec<(FrameCrop, RemapTable)>);

impl Mosaic {
    /// Distributes crops, whose sides are half of the input's, to as few inputs as possible.
    pub(super) fn of(crops: &[(FrameCrop, RemapTable)]) -> Vec<Self> {
        let mosaics = crops.chunks(TILES).map(|tiles| Self(tiles.to_vec()));
        mosaics.collect()
    }

    /// Returns the crops.
    pub(super) fn crops(&self) -> impl Iterator<Item = &FrameCrop> {
        self.0.iter().map(|(crop, _)| crop)
    }

    /// Returns the remap tables.
    pub(super) fn tables(&self) -> impl Iterator<Item = &RemapTable> {
        self.0.iter().map(|(_, table)| table)
    }

    /// Renders the tiles into the slot `[3, height, width]` of the network's input. Places without a
    /// tile are black.
    pub(super) fn render(&self, frame: &Frame, input: &NetworkInput, slot: &mut [f32]) {
        for (plane, offset) in slot.chunks_exact_mut(input.plane_len()).zip(input.offset) {
            plane.fill(offset);
        }
        let mut pixels = Vec::new();
        for (index, (crop, table)) in self.0.iter().enumerate() {
            let tile = NetworkInput {
                width: crop.width,
                height: crop.height,
                ..input.clone()
            };
            pixels.resize(tile.view_len(), 0.0);
            table.render(frame, &tile, &mut pixels);
            let [left, top] = corner(index, crop).map(|at| at as usize);
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

    /// Returns the crop whose tile holds the middle of a box, and the corners of the box within that
    /// tile. `None` where there is no tile.
    pub(super) fn tile_of(&self, bbox: &BBox<ViewPixels>) -> Option<(&FrameCrop, [f64; 4])> {
        let [x, y] = bbox.center();
        self.0.iter().enumerate().find_map(|(index, (crop, _))| {
            let [left, top] = corner(index, crop).map(f64::from);
            let (width, height) = (f64::from(crop.width), f64::from(crop.height));
            let is_within = (left..left + width).contains(&x) && (top..top + height).contains(&y);
            let [x_min, y_min, x_max, y_max] = bbox.corners();
            let local = [
                (x_min - left).max(0.0),
                (y_min - top).max(0.0),
                (x_max - left).min(width),
                (y_max - top).min(height),
            ];
            is_within.then_some((crop, local))
        })
    }
}

/// The left upper corner of a tile in the input, pixels.
fn corner(index: usize, crop: &FrameCrop) -> [u32; 2] {
    // There are four tiles.
    let index = u32::try_from(index).unwrap_or_default();
    [
        index % TILES_PER_SIDE * crop.width,
        index / TILES_PER_SIDE * crop.height,
    ]
}

#[cfg(test)]
mod tests {
    use lookdown_lens::geometry::{Pixel, QuarterTurn};

    use super::*;

    /// A crop of 40 × 40 pixels of the frame at its own scale.
    fn crop(x: f64, y: f64) -> FrameCrop {
        FrameCrop {
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
        let tables = crops.map(|crop| RemapTable::of_crop(&crop, 200, 200));
        let crops: Vec<_> = crops.into_iter().zip(tables).collect();
        let mosaics = Mosaic::of(&crops);
        assert_eq!(mosaics.len(), 2);
        let input = NetworkInput::plain(80, 80);
        let mut slot = vec![0.0; input.view_len()];
        mosaics[0].render(&frame, &input, &mut slot);
        for (left, top) in [(5_u32, 5_u32), (45, 5), (5, 45), (45, 45)] {
            let corners = [left, top, left + 20, top + 20].map(f64::from);
            let bbox = BBox::new(corners).unwrap();
            let (crop, local) = mosaics[0].tile_of(&bbox).unwrap();
            let [x, y, ..] = crop.frame_box(local);
            let index = top as usize * 80 + left as usize;
            let shown = [slot[index], slot[input.plane_len() + index]].map(f64::from);
            assert!((shown[0] - x).abs() < 0.6 && (shown[1] - y).abs() < 0.6);
        }
        let beside = BBox::new([50.0, 50.0, 60.0, 60.0]).unwrap();
        assert!(mosaics[1].tile_of(&beside).is_none());
    }
}

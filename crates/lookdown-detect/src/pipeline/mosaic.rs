//! Mosaics: several small crops of a frame in one input of the network.

use lookdown_lens::geometry::FrameCrop;

use crate::detection::{BBox, ViewPixels};
use lookdown_imaging::{Frame, NetworkInput, RemapTable};

/// The number of tiles along each side of a mosaic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Grid {
    /// Four tiles.
    Two = 2,
    /// Nine tiles.
    Three = 3,
}

impl Grid {
    /// Returns the number of tiles along each side.
    pub(super) fn per_side(self) -> u32 {
        self as u32
    }

    /// Returns the number of tiles.
    pub(super) fn tiles(self) -> usize {
        let per_side = self as usize;
        per_side * per_side
    }
}

/// Crops side by side, row by row, at most as many as its grid has tiles.
#[derive(Debug)]
pub(super) struct Mosaic {
    grid: Grid,
    tiles: Vec<(FrameCrop, RemapTable)>,
}

impl Mosaic {
    /// Distributes crops, whose sides are those of the grid's tiles, to as few inputs as possible.
    pub(super) fn for_crops(grid: Grid, crops: &[(FrameCrop, RemapTable)]) -> Vec<Self> {
        let chunks = crops.chunks(grid.tiles());
        let mosaics = chunks.map(|tiles| Self {
            grid,
            tiles: tiles.to_vec(),
        });
        mosaics.collect()
    }

    /// Returns the crops.
    pub(super) fn crops(&self) -> impl Iterator<Item = &FrameCrop> {
        self.tiles.iter().map(|(crop, _)| crop)
    }

    /// Returns the remap tables.
    pub(super) fn tables(&self) -> impl Iterator<Item = &RemapTable> {
        self.tiles.iter().map(|(_, table)| table)
    }

    /// Renders the tiles into the slot `[3, height, width]` of the network's input. Places without
    /// a tile are black.
    pub(super) fn render(&self, frame: &Frame, input: &NetworkInput, slot: &mut [f32]) {
        for (plane, offset) in slot.chunks_exact_mut(input.plane_len()).zip(input.offset) {
            plane.fill(offset);
        }
        let mut pixels = Vec::new();
        for (index, (crop, table)) in self.tiles.iter().enumerate() {
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

    /// Returns the crop whose tile holds the middle of a box, and the corners of the box within
    /// that tile. `None` where there is no tile.
    pub(super) fn tile_of(&self, bbox: &BBox<ViewPixels>) -> Option<(&FrameCrop, [f64; 4])> {
        let [x, y] = bbox.center();
        self.tiles
            .iter()
            .enumerate()
            .find_map(|(index, (crop, _))| {
                let [left, top] = self.corner(index, crop).map(f64::from);
                let (width, height) = (f64::from(crop.width), f64::from(crop.height));
                let is_within =
                    (left..left + width).contains(&x) && (top..top + height).contains(&y);
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

    /// Returns the left upper corner of a tile in the input, pixels.
    fn corner(&self, index: usize, crop: &FrameCrop) -> [u32; 2] {
        // There are nine tiles at most.
        let index = u32::try_from(index).unwrap_or_default();
        let per_side = self.grid.per_side();
        [
            index % per_side * crop.width,
            index / per_side * crop.height,
        ]
    }
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
        let mosaics = Mosaic::for_crops(Grid::Two, &crops);
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
        let wide = Mosaic::for_crops(Grid::Three, &crops);
        assert_eq!(wide.len(), 1);
        let last = BBox::new([45.0, 45.0, 65.0, 65.0]).unwrap();
        let (crop, _) = wide[0].tile_of(&last).unwrap();
        assert_eq!(crop.center, Pixel::new(40.0, 40.0));
        let beside = BBox::new([50.0, 50.0, 60.0, 60.0]).unwrap();
        assert!(mosaics[1].tile_of(&beside).is_none());
    }
}

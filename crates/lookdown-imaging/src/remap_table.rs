//! Remap tables: where a view samples the frame, and the sampling itself.

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "vector instructions")]
mod avx2;
mod band;
mod block_size;
mod frame_from_plane;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
#[cfg(target_arch = "aarch64")]
#[expect(unsafe_code, reason = "vector instructions")]
mod neon;
mod node_grid;
mod rendering;
mod scalar;
mod visibility;

use std::{collections::HashSet, ops::Range, sync::Arc};

use lookdown_lens::geometry::{FrameCrop, Lens, Panorama, Pixel, VirtualView};
use rayon::prelude::*;

use crate::{Frame, MaskedPixels, NetworkInput};

use band::Band;
use block_size::LANES;
use frame_from_plane::FrameFromPlane;
use node_grid::NodeGrid;
use rendering::{Planes, Source};
use scalar::Sample;

#[cfg(target_arch = "x86_64")]
use self::avx2 as vector;
#[cfg(target_arch = "aarch64")]
use self::neon as vector;

/// One view's sampling positions.
///
/// Exact at every eighth pixel across and down and interpolated bilinearly in between, so that a
/// block of eight pixels is one vector. In the normalized plane of a lens that is the same in every
/// azimuth, views that are turned from each other about the optical axis have one and the same
/// grid; only an affine map to the frame is each view's own.
///
/// How far that is from where the lens really is, was measured with a lens of each model on a frame
/// of 1680 pixels: in the views of the `balanced` plan and two of 75° at the nadir, at 416 pixels,
/// at most 0.17 pixels of the frame and 0.13 of the view (means 0.04 and 0.03), in views of 300
/// pixels and 90° 0.35 and 0.18 (0.12 and 0.06).
/// Two models are off by more where they distort most: `rectilinear`, which stretches its rim, by
/// up to 2.6 pixels of the frame, which are 0.2 of the view; `orthographic`, which squeezes it, by
/// up to 1.1 pixels of the view, which are 0.6 of the frame. Narrower or larger views are off by
/// less.
#[derive(Debug, Clone)]
pub struct RemapTable {
    grid: Arc<NodeGrid>,
    frame_from_plane: FrameFromPlane,
    whole_patches: WholePatches,
    frame_width: u32,
    frame_height: u32,
}

impl RemapTable {
    /// The tables of `views` into frames of `frame_width` × `frame_height` pixels (both at least 2)
    /// taken through `lens`, one per view. Tables with a common grid share its memory.
    pub fn for_views(
        views: &[VirtualView],
        lens: &Lens,
        frame_width: u32,
        frame_height: u32,
    ) -> Vec<Self> {
        // Of each view, whose grid it takes: an index into the views with grids of their own.
        let mut own: Vec<&VirtualView> = Vec::new();
        let shared: Vec<(usize, f64)> = views
            .iter()
            .map(|view| {
                let turns = own.iter().map(|first| view.turned_from(first)).enumerate();
                let mut found = turns.filter_map(|(grid, turn)| turn.map(|turn| (grid, turn)));
                let found = lens.is_symmetric().then(|| found.next()).flatten();
                found.unwrap_or_else(|| {
                    own.push(view);
                    (own.len() - 1, 0.0)
                })
            })
            .collect();
        let grids: Vec<_> = own
            .into_par_iter()
            .map(|view| Arc::new(NodeGrid::new(view, lens)))
            .collect();
        let table = |(grid, turn): (usize, f64)| {
            let frame_from_plane = FrameFromPlane::new(lens.image_plane(), turn);
            let grid = Arc::clone(&grids[grid]);
            Self::from_grid(grid, frame_from_plane, frame_width, frame_height)
        };
        shared.into_iter().map(table).collect()
    }

    /// The table of a panorama into frames of `frame_width` × `frame_height` pixels. The lens image
    /// ends at a node.
    pub fn for_panorama(
        panorama: &Panorama,
        lens: &Lens,
        frame_width: u32,
        frame_height: u32,
    ) -> Self {
        let grid = Arc::new(NodeGrid::for_panorama(panorama, lens));
        let frame_from_plane = FrameFromPlane::new(lens.image_plane(), 0.0);
        Self::from_grid(grid, frame_from_plane, frame_width, frame_height)
    }

    /// The table of a crop of frames of `frame_width` × `frame_height` pixels. Positions are exact
    /// between nodes as well; what lies beyond the lens image is shown as the frame has it.
    pub fn for_crop(crop: &FrameCrop, frame_width: u32, frame_height: u32) -> Self {
        let grid = Arc::new(NodeGrid::for_crop(crop));
        Self::from_grid(grid, FrameFromPlane::identity(), frame_width, frame_height)
    }

    fn from_grid(
        grid: Arc<NodeGrid>,
        frame_from_plane: FrameFromPlane,
        frame_width: u32,
        frame_height: u32,
    ) -> Self {
        let whole_patches = WholePatches::new(&grid, &frame_from_plane, frame_width, frame_height);
        Self {
            grid,
            frame_from_plane,
            whole_patches,
            frame_width,
            frame_height,
        }
    }

    /// Returns the position in the frame (pixel centers) that the view's pixel (`x`, `y`) samples,
    /// also beyond the frame's borders. `None` beyond the lens image.
    ///
    /// # Panics
    /// Panics if the pixel lies outside the view.
    pub fn position(&self, x: u32, y: u32) -> Option<Pixel> {
        let (x, y) = (x as usize, y as usize);
        let band = self.band(y / LANES);
        let patch = band.patch(x / LANES);
        let lanes = band.lanes(y % LANES, x / LANES);
        let is_visible = lanes >> (x % LANES) & 1 == 1;
        let [x, y] = patch.block(y % LANES).position(x % LANES).map(f64::from);
        (is_visible && !x.is_nan()).then(|| Pixel::new(x, y))
    }

    /// Returns true if a pixel of the view shows a part of the lens image in the frame.
    pub fn sees_anything(&self) -> bool {
        self.has_sample(|_| true)
    }

    /// Returns true if a pixel of the view shows an unmasked part of the lens image.
    pub fn sees_beside(&self, masked: &MaskedPixels) -> bool {
        self.sees_pixel(|x, y| !masked.hides(x, y))
    }

    /// Returns true if a pixel of the view depends on a pixel of the frame for which `counts`
    /// holds.
    pub fn sees_pixel(&self, counts: impl Fn(u32, u32) -> bool) -> bool {
        let width = self.frame_width as usize;
        self.has_sample(|sample| {
            let mut neighbors = sample.neighbors(width);
            neighbors.any(|[x, y]| counts(x, y))
        })
    }

    /// Returns true if a pixel of the view has a sample for which `counts` holds.
    fn has_sample(&self, counts: impl Fn(&Sample) -> bool) -> bool {
        let (width, height) = (self.frame_width as usize, self.frame_height as usize);
        (0..self.grid.visibility.bands()).any(|index| {
            let band = self.band(index);
            (0..band.patches()).any(|index| {
                let patch = band.patch(index);
                (0..band.rows.len()).any(|row| {
                    let lanes = band.lanes(row, index);
                    let samples = patch.block(row).samples(lanes, width, height);
                    samples.iter().flatten().any(&counts)
                })
            })
        })
    }

    /// Memory held by some tables, bytes; what several of them share counts once.
    pub fn bytes<'a>(tables: impl IntoIterator<Item = &'a Self>) -> usize {
        let mut counted = HashSet::new();
        let bytes = tables.into_iter().map(|table| {
            let is_first = counted.insert(Arc::as_ptr(&table.grid));
            let grid = if is_first { table.grid.bytes() } else { 0 };
            size_of::<Self>() + table.whole_patches.bytes() + grid
        });
        bytes.sum()
    }

    /// Samples, scales and lays out in one pass: `frame` (of the size the table was made for)
    /// into one view's slot `[3, height, width]` of the network's input (of the view's size).
    /// Pixels that see nothing of the lens image become black.
    pub fn render(&self, frame: &Frame, input: &NetworkInput, slot: &mut [f32]) {
        self.render_bands(frame, input, slot, render_band);
    }

    /// Samples `frame` into the rectangle of `image` with this upper left corner and the size of
    /// the view. Pixels that see nothing of the lens image become black.
    ///
    /// # Panics
    /// Panics if the rectangle reaches beyond the image.
    pub fn paint(
        &self,
        frame: &Frame,
        [width, height]: [u32; 2],
        image: &mut Frame,
        [left, top]: [u32; 2],
    ) {
        let input = NetworkInput::plain(width, height);
        let source = Source::new(frame, &input);
        let (stride, width) = (3 * image.width() as usize, width as usize);
        let columns = 3 * left as usize..3 * (left as usize + width);
        let mut rows = image
            .pixels_mut()
            .chunks_exact_mut(stride)
            .skip(top as usize);
        // A band stays in the cache of the processor.
        let mut values = vec![0.0; 3 * LANES * width];
        for index in 0..self.grid.visibility.bands() {
            let band = self.band(index);
            let plane_len = band.rows.len() * width;
            let (red, rest) = values.split_at_mut(plane_len);
            let (green, rest) = rest.split_at_mut(plane_len);
            let blue = &mut rest[..plane_len];
            render_band(&source, &band, [&mut *red, &mut *green, &mut *blue]);
            let planes = red.chunks_exact(width).zip(green.chunks_exact(width));
            let planes = planes.zip(blue.chunks_exact(width));
            for (((red, green), blue), row) in planes.zip(&mut rows) {
                let pixels = row[columns.clone()].as_chunks_mut().0;
                let colors = red.iter().zip(green).zip(blue);
                for (pixel, ((red, green), blue)) in pixels.iter_mut().zip(colors) {
                    *pixel = [*red, *green, *blue].map(rounded);
                }
            }
        }
    }

    /// Portable version of [`RemapTable::render`] for processors without supported vector
    /// instructions. The results are bit-identical.
    pub fn render_portably(&self, frame: &Frame, input: &NetworkInput, slot: &mut [f32]) {
        self.render_bands(frame, input, slot, scalar::render);
    }

    fn render_bands(
        &self,
        frame: &Frame,
        input: &NetworkInput,
        slot: &mut [f32],
        render: impl Fn(&Source, &Band, Planes),
    ) {
        debug_assert_eq!(
            (frame.width(), frame.height()),
            (self.frame_width, self.frame_height)
        );
        let source = Source::new(frame, input);
        let (first, rest) = slot.split_at_mut(input.plane_len());
        let (second, third) = rest.split_at_mut(input.plane_len());
        let band_len = LANES * input.width as usize;
        let [first, second, third] = [first, second, third].map(|plane| plane.chunks_mut(band_len));
        for (index, ((first, second), third)) in first.zip(second).zip(third).enumerate() {
            let mut planes = [first, second, third];
            if input.source_channels()[0] != 0 {
                planes.reverse();
            }
            render(&source, &self.band(index), planes);
        }
    }

    fn band(&self, index: usize) -> Band<'_> {
        let visibility = &self.grid.visibility;
        Band {
            above: self.grid.nodes(index),
            below: self.grid.nodes(index + 1),
            frame_from_plane: &self.frame_from_plane,
            visibility,
            rows: visibility.rows_of_band(index),
            whole_patches: self.whole_patches.band(index),
        }
    }
}

/// Renders a band with the fastest instructions of this processor.
fn render_band(source: &Source, band: &Band, planes: Planes) {
    #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
    if let Some(supported) = vector::Supported::detect()
        && i32::try_from(source.pixels.len()).is_ok()
    {
        return vector::render(supported, source, band, planes);
    }
    scalar::render(source, band, planes);
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a mean of bytes"
)]
fn rounded(value: f32) -> u8 {
    (value + 0.5) as u8
}

/// For each band of a view, the longest run of patches whose pixels all show the lens image, a
/// pixel or more from the frame's borders.
#[derive(Debug, Clone)]
struct WholePatches {
    bands: Vec<[u32; 2]>,
}

impl WholePatches {
    fn new(
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
        let visibility = &grid.visibility;
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

    fn band(&self, index: usize) -> Range<usize> {
        let [start, end] = self.bands[index].map(|patch| patch as usize);
        start..end
    }

    /// Memory held, bytes.
    fn bytes(&self) -> usize {
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

#[cfg(test)]
mod tests;

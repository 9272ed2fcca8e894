//! Rendering a band of a view, eight pixels at a time, whichever way these are sampled.

use super::{
    band::{Band, Block, Seen},
    block_size::LANES,
};
use crate::{Frame, NetworkInput};

/// Weights of right neighbors are whole fractions of this: with pixels of eight bits, a product
/// of 16-bit numbers loses nothing.
pub(super) const WEIGHT_ONE: i16 = 1 << 14;

/// Patches that fill a cache line.
const LINE_PATCHES: usize = 2;

/// Number of pixels between the prefetched and the written position.
const AHEAD: usize = 2 * LINE_PATCHES * LANES;

/// Input of the sampling, and the conversion of its samples.
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

/// Output planes for red, green and blue.
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

/// Renders `band` into `planes`, each of which holds as many rows as the band has: patch by patch,
/// so that what is sampled lies close together. Of all rows of a patch it is found out first where
/// they sample (`locate`; it is not asked where no pixel sees anything), so that the processor need
/// not wait for one before it begins with the next. `sample` gets that and the row's index.
/// `announce` gets places that will soon be written: one of each cache line.
#[expect(
    clippy::inline_always,
    reason = "`locate` and `sample` become vector code only within a function that may use it"
)]
#[inline(always)]
pub(super) fn render_band<Samples>(
    source: &Source,
    band: &Band,
    planes: Planes,
    locate: impl Fn(&Block, Seen) -> Samples,
    sample: impl Fn(&Samples, usize) -> Values,
    announce: impl Fn(&f32),
) {
    let [red, green, blue] = planes;
    let rows = band.rows.len();
    let width = red.len() / rows;
    let mut located: [Option<Samples>; LANES] = [const { None }; LANES];
    for index in 0..band.patches() {
        let patch = band.patch(index);
        if band.whole_patches.contains(&index) {
            for (row, samples) in located[..rows].iter_mut().enumerate() {
                *samples = Some(locate(&patch.block(row), Seen::Whole));
            }
        } else {
            for (row, samples) in located[..rows].iter_mut().enumerate() {
                let lanes = band.lanes(row, index);
                *samples = (lanes != 0).then(|| locate(&patch.block(row), Seen::Lanes(lanes)));
            }
        }
        let first_pixel = index * LANES;
        if index % LINE_PATCHES == 0 {
            for plane in [&*red, &*green, &*blue] {
                for row in 0..rows {
                    if let Some(place) = plane.get(row * width + first_pixel + AHEAD) {
                        announce(place);
                    }
                }
            }
        }
        let count = LANES.min(width - first_pixel);
        for (row, samples) in located.iter().enumerate().take(rows) {
            let [reds, greens, blues] = match samples {
                Some(samples) => sample(samples, row),
                None => source.offset.map(|value| [value; LANES]),
            };
            let start = row * width + first_pixel;
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

/// The bytes of two neighboring pixels, and two more.
pub(super) const PAIR_BYTES: usize = 8;

/// The frame seen from two places. Eight bytes from the first one's start are a pixel and its right
/// neighbor and two more bytes; eight from the second one's are two bytes and then the pixels
/// below these. So no read reaches beyond the frame: at its last pixels both end with a line.
pub(super) struct FrameLines<'a> {
    pub(super) upper: &'a [u8],
    pub(super) lower: &'a [u8],
}

impl<'a> FrameLines<'a> {
    pub(super) fn new(source: &Source<'a>) -> Self {
        let line = 3 * source.width;
        let lower = &source.pixels[line - 2..];
        Self {
            upper: &source.pixels[..lower.len()],
            lower,
        }
    }
}

/// Eight bytes of `lines` from the given one.
#[inline]
pub(super) fn pair(lines: &[u8], first_byte: u32) -> [u8; PAIR_BYTES] {
    // Never more than the last one; said so for the sake of the compiler.
    let first = (first_byte as usize).min(lines.len() - PAIR_BYTES);
    let mut bytes = [0; PAIR_BYTES];
    bytes.copy_from_slice(&lines[first..first + PAIR_BYTES]);
    bytes
}

//! Reading pairs of pixels for vectors, through slices that are checked.

use super::rendering::Source;

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

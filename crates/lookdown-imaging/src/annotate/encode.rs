//! Encoding of a frame as JPEG or PNG.

use std::error::Error;

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use jpeg_encoder::{Encoder as JpegEncoder, ImageBuffer, JpegColorType, SamplingFactor};
use multiversion::multiversion;

use crate::frame::Frame;

/// A frame cannot be encoded.
#[derive(Debug, thiserror::Error)]
#[error("a frame of {width}×{height} pixels cannot be written as {format}: {source}")]
pub struct EncodeError {
    format: &'static str,
    width: u32,
    height: u32,
    source: Box<dyn Error + Send + Sync>,
}

impl EncodeError {
    fn new(
        frame: &Frame,
        format: &'static str,
        source: impl Into<Box<dyn Error + Send + Sync>>,
    ) -> Self {
        Self {
            format,
            width: frame.width(),
            height: frame.height(),
            source: source.into(),
        }
    }
}

/// A frame as the encoder reads it. The encoder's function for bytes is compiled for each of eleven
/// types of pixels.
struct Rows<'a> {
    frame: &'a Frame,
    width: u16,
    height: u16,
}

impl ImageBuffer for Rows<'_> {
    fn get_jpeg_color_type(&self) -> JpegColorType {
        JpegColorType::Ycbcr
    }

    fn width(&self) -> u16 {
        self.width
    }

    fn height(&self) -> u16 {
        self.height
    }

    fn fill_buffers(&self, y: u16, buffers: &mut [Vec<u8>; 4]) {
        let width = usize::from(self.width);
        let row_bytes = 3 * width;
        let row = usize::from(y) * row_bytes;
        let pixels = self.frame.pixels()[row..row + row_bytes].as_chunks().0;
        let [luma, blue, red, _] = buffers;
        let start = luma.len();
        for buffer in [&mut *luma, &mut *blue, &mut *red] {
            buffer.resize(start + width, 0);
        }
        fill_luma(pixels, &mut luma[start..]);
        // Of colors, the encoder takes every second value of every second row.
        if (start / width.next_multiple_of(BLOCK)).is_multiple_of(2) {
            fill_colors(pixels, &mut blue[start..], &mut red[start..]);
        }
    }
}

/// Side of the blocks of pixels that JPEG keeps together with colors at half resolution.
const BLOCK: usize = 16;

// ITU-T T.871, section 7, with weights divided by 256: vectors hold twice as many 16-bit numbers,
// and the error is less than half a level.

#[multiversion(targets("x86_64+avx2"))]
fn fill_luma(pixels: &[[u8; 3]], luma: &mut [u8]) {
    for (pixel, luma) in pixels.iter().zip(luma) {
        let [r, g, b] = pixel.map(u16::from);
        *luma = ((77 * r + 150 * g + 29 * b + 128) >> 8) as u8;
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn fill_colors(pixels: &[[u8; 3]], blue: &mut [u8], red: &mut [u8]) {
    // 128 levels and nearly a half to round by: with a whole half, pure blue would exceed a byte.
    const MIDDLE: u16 = 128 * 256 + 127;
    for ((pixel, blue), red) in pixels.iter().zip(blue).zip(red) {
        let [r, g, b] = pixel.map(u16::from);
        *blue = ((MIDDLE - 43 * r - 85 * g).wrapping_add(128 * b) >> 8) as u8;
        *red = ((MIDDLE - 107 * g - 21 * b).wrapping_add(128 * r) >> 8) as u8;
    }
}

/// Encodes the frame as JPEG with colors at half resolution. `quality` is clamped to 1 to 100.
///
/// # Errors
/// Returns an error if a side is longer than the 65535 pixels that JPEG can hold.
pub fn encode_jpeg(frame: &Frame, quality: u8) -> Result<Vec<u8>, EncodeError> {
    let failed = |source: Box<dyn Error + Send + Sync>| EncodeError::new(frame, "JPEG", source);
    let rows = Rows {
        width: u16::try_from(frame.width()).map_err(|error| failed(error.into()))?,
        height: u16::try_from(frame.height()).map_err(|error| failed(error.into()))?,
        frame,
    };
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new(&mut bytes, quality.clamp(1, 100));
    encoder.set_sampling_factor(SamplingFactor::R_4_2_0);
    encoder
        .encode_image(rows)
        .map_err(|error| failed(error.into()))?;
    Ok(bytes)
}

/// Encodes the frame as PNG, without loss.
///
/// # Errors
/// Returns an error if the encoder fails. No frame is known to cause this.
pub fn encode_png(frame: &Frame) -> Result<Vec<u8>, EncodeError> {
    let (width, height) = (frame.width(), frame.height());
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(frame.pixels(), width, height, ExtendedColorType::Rgb8)
        .map_err(|error| EncodeError::new(frame, "PNG", error))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::{DecodeLimits, decode};

    #[test]
    fn colors_of_images_of_any_size_are_kept() {
        for (width, height) in [(1, 1), (16, 17), (37, 21), (40, 32)] {
            for color in [[200, 40, 90], [0, 0, 255], [255, 0, 0], [255, 255, 255]] {
                let pixels = color.repeat((width * height) as usize);
                let frame = Frame::new(width, height, pixels).unwrap();
                let jpeg = encode_jpeg(&frame, 95).unwrap();
                let decoded = decode(&jpeg, &DecodeLimits::default()).unwrap().frame;
                for pixel in decoded.pixels().as_chunks::<3>().0 {
                    let differences = [0, 1, 2].map(|at: usize| pixel[at].abs_diff(color[at]));
                    assert!(
                        differences.iter().all(|one| *one < 8),
                        "{color:?}: {pixel:?}"
                    );
                }
            }
        }
    }
}

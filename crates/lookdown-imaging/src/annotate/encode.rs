//! Encoding of a frame as JPEG or PNG.

use std::error::Error;

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use jpeg_encoder::{
    Encoder as JpegEncoder, ImageBuffer, JpegColorType, SamplingFactor, rgb_to_ycbcr,
};

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
        let row_bytes = 3 * usize::from(self.width);
        let start = usize::from(y) * row_bytes;
        let [luma, blue, red, _] = buffers;
        for pixel in self.frame.pixels()[start..start + row_bytes].as_chunks().0 {
            let [r, g, b] = *pixel;
            let (y, cb, cr) = rgb_to_ycbcr(r, g, b);
            luma.push(y);
            blue.push(cb);
            red.push(cr);
        }
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

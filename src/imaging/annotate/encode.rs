//! Encoding of a frame as JPEG or PNG.

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageError};

use crate::imaging::frame::Frame;

/// A frame cannot be encoded.
#[derive(Debug, thiserror::Error)]
#[error("a frame of {width}×{height} pixels cannot be written as {format}: {source}")]
pub struct EncodeError {
    format: &'static str,
    width: u32,
    height: u32,
    source: ImageError,
}

/// Encodes the frame as JPEG. `quality` is clamped to 1 to 100.
///
/// # Errors
/// Returns an error if a side is longer than the 65535 pixels that JPEG can hold.
pub fn encode_jpeg(frame: &Frame, quality: u8) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Vec::new();
    encode(
        frame,
        "JPEG",
        JpegEncoder::new_with_quality(&mut bytes, quality),
    )?;
    Ok(bytes)
}

/// Encodes the frame as PNG, without loss.
///
/// # Errors
/// Returns an error if the encoder fails. No frame is known to cause this.
pub fn encode_png(frame: &Frame) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Vec::new();
    encode(frame, "PNG", PngEncoder::new(&mut bytes))?;
    Ok(bytes)
}

fn encode(
    frame: &Frame,
    format: &'static str,
    encoder: impl ImageEncoder,
) -> Result<(), EncodeError> {
    let (width, height) = (frame.width(), frame.height());
    encoder
        .write_image(frame.pixels(), width, height, ExtendedColorType::Rgb8)
        .map_err(|source| EncodeError {
            format,
            width,
            height,
            source,
        })
}

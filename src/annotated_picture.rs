//! Found persons drawn into their frame, as a picture to send or to save: what is drawn, how large
//! and in which file format; and frames that are kept to be drawn into later.

mod kept;
mod marks;
mod options;
mod sketch;

use std::sync::Arc;

use crate::{
    imaging::{
        Frame,
        annotate::{EncodeError, annotate, encode_jpeg, encode_png},
        narrowed,
    },
    pipeline::Detected,
};

pub use kept::{KeptFrame, KeptFrameError};
pub use options::{Layer, PictureOptions};
use sketch::Sketch;

/// A file format of pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    /// JPEG, in the quality of the options.
    Jpeg,
    /// PNG, without loss.
    Png,
}

/// Draws what was found into its frame. Takes tens of milliseconds for a large frame: keep it off
/// the async runtime.
///
/// # Errors
/// [`EncodeError`] when the frame is larger than the format allows.
pub fn annotated_picture(
    detected: Detected,
    format: PictureFormat,
    options: &PictureOptions,
) -> Result<Vec<u8>, EncodeError> {
    let sketch = Sketch::of(&detected, &options.layers);
    drawn(detected.frame, &sketch, format, options)
}

/// Draws into a frame, which may be smaller than the one that the sketch was made of.
fn drawn(
    frame: Arc<Frame>,
    sketch: &Sketch,
    format: PictureFormat,
    options: &PictureOptions,
) -> Result<Vec<u8>, EncodeError> {
    let width = options.width.unwrap_or(u32::MAX);
    let mut picture = if frame.width() > width {
        narrowed(&frame, width)
    } else {
        Arc::unwrap_or_clone(frame)
    };
    let drawing = sketch.drawing(picture.width(), &options.layers);
    annotate(&mut picture, &drawing);
    match format {
        PictureFormat::Jpeg => encode_jpeg(&picture, options.quality),
        PictureFormat::Png => encode_png(&picture),
    }
}

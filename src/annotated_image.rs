//! Annotated images: detected persons drawn into their frame, with options for layers, size and
//! file format. Frames can also be kept to be drawn into later.

mod kept;
mod options;
mod sketch;

use std::sync::Arc;

pub use kept::{StoredFrame, StoredFrameError};
use lookdown_detect::pipeline::DetectedFrame;
use lookdown_imaging::{
    Frame,
    annotate::{
        Cancelled, Concealment, EncodeError, Mark, annotate_unless, conceal, encode_jpeg,
        encode_png,
    },
    narrowed,
};
pub use options::{AnnotationOptions, Layer};
use sketch::Sketch;

/// A file format of images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageFormat {
    /// JPEG, in the quality of the options.
    Jpeg,
    /// PNG, lossless.
    Png,
}

/// The reason why there is no annotated image.
#[derive(Debug, thiserror::Error)]
pub enum AnnotationError {
    /// The client no longer waits for it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The frame is larger than the format allows.
    #[error(transparent)]
    Encode(#[from] EncodeError),
}

/// Draws the persons into their frame. Takes tens of milliseconds for a large frame: keep it off
/// the async runtime. Stops when the job is withdrawn.
///
/// # Errors
/// [`AnnotationError`] if the frame is larger than the format allows, or the job was withdrawn.
pub fn annotated_image(
    detected: DetectedFrame,
    format: ImageFormat,
    options: &AnnotationOptions,
) -> Result<Vec<u8>, AnnotationError> {
    let sketch = Sketch::new(&detected, &options.layers);
    let is_cancelled = || detected.withdrawn.is_cancelled();
    drawn(detected.frame, &sketch, format, options, &is_cancelled)
}

/// Returns the marks of all people to be concealed, in pixels of the frame: also of those that are
/// in no result.
pub(crate) fn marks_to_conceal(detected: &DetectedFrame) -> Vec<Mark> {
    Sketch::new(detected, &[]).concealed(detected.frame.width())
}

/// Draws into a frame, which may be smaller than the one that the sketch was made of.
fn drawn(
    frame: Arc<Frame>,
    sketch: &Sketch,
    format: ImageFormat,
    options: &AnnotationOptions,
    is_cancelled: &dyn Fn() -> bool,
) -> Result<Vec<u8>, AnnotationError> {
    let mut image = if frame.width() > options.width {
        narrowed(&frame, options.width)
    } else {
        Arc::unwrap_or_clone(frame)
    };
    let drawing = sketch.drawing(image.width(), &options.layers);
    for (layer, concealment) in [
        (Layer::Blur, Concealment::Blur),
        (Layer::Silhouette, Concealment::Silhouette),
    ] {
        if options.layers.contains(&layer) {
            let marks = sketch.concealed(image.width());
            conceal(&mut image, &marks, concealment, is_cancelled)?;
        }
    }
    annotate_unless(&mut image, &drawing, is_cancelled)?;
    let encoded = match format {
        ImageFormat::Jpeg => encode_jpeg(&image, options.quality),
        ImageFormat::Png => encode_png(&image),
    };
    Ok(encoded?)
}

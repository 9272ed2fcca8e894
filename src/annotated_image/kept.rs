//! A frame that is kept with its sketch, so that it can be drawn later with other options, also on
//! another server.

use std::sync::Arc;

use bytes::Bytes;
use lookdown_common::JPEG_START;
use lookdown_detect::pipeline::DetectedFrame;
use lookdown_imaging::{
    Frame,
    annotate::{Concealment, EncodeError, conceal, encode_jpeg},
    decode::{DecodeError, DecodeLimits, decode},
    narrowed,
};
use strum::VariantArray;

use super::{AnnotationError, AnnotationOptions, ImageFormat, Layer, drawn, sketch::Sketch};

/// Wider frames are scaled down to the first of these widths, and to the next one while their files
/// are too large.
const WIDTHS: [u32; 3] = [2560, 1280, 640];
/// High enough that the loss is hardly visible, even after a second encoding.
const QUALITY: u8 = 92;
/// 4 MiB: cameras deliver smaller frames.
const MAX_BYTES: usize = 4 << 20;

/// A kept frame. Areas that the calibration masks are masked in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredFrame {
    /// The frame, at most 4 MiB.
    pub jpeg: Bytes,
    /// The drawings that can be added to it, JSON.
    pub sketch: Bytes,
}

/// The reason why a frame cannot be kept or drawn.
#[derive(Debug, thiserror::Error)]
pub enum StoredFrameError {
    /// The sketch cannot be serialized or parsed.
    #[error("the sketch of a kept frame is invalid: {0}")]
    Sketch(#[from] serde_json::Error),
    /// The frame cannot be decoded.
    #[error("a kept frame cannot be decoded: {0}")]
    Frame(#[from] DecodeError),
    /// The frame cannot be encoded.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The image cannot be drawn.
    #[error(transparent)]
    Annotation(#[from] AnnotationError),
    /// The frame is too large at every width.
    #[error("a frame takes more than {MAX_BYTES} bytes as a JPEG of {} pixels across", WIDTHS[2])]
    TooLarge,
}

impl StoredFrame {
    /// Keeps a frame, with its persons concealed if `concealment` is given: its original JPEG, if
    /// that is small enough and nothing is masked or concealed, else a new one. A new one takes
    /// tens of milliseconds for a large frame: keep it off the async runtime.
    ///
    /// # Errors
    /// [`StoredFrameError`] for a frame that cannot be kept.
    pub fn new(
        detected: &DetectedFrame,
        concealment: Option<Concealment>,
    ) -> Result<Self, StoredFrameError> {
        let sketch = Sketch::new(detected, Layer::VARIANTS).rounded();
        let jpeg = match (concealment, &detected.encoded) {
            (Some(concealment), _) => {
                let mut frame = Frame::clone(&detected.frame);
                let marks = sketch.concealed(frame.width());
                let is_cancelled = || detected.withdrawn.is_cancelled();
                conceal(&mut frame, &marks, concealment, &is_cancelled)
                    .map_err(AnnotationError::from)?;
                jpeg_of(&frame)?
            }
            (None, Some(encoded)) if is_kept_as_it_is(encoded, &detected.frame) => {
                // A copy, so that the rest of the request body can be freed.
                Bytes::copy_from_slice(encoded)
            }
            _ => jpeg_of(&detected.frame)?,
        };
        let sketch = serde_json::to_vec(&sketch)?.into();
        Ok(Self { jpeg, sketch })
    }

    /// Returns the memory that it takes, bytes.
    pub fn bytes(&self) -> usize {
        self.jpeg.len() + self.sketch.len()
    }

    /// Returns the frame as JPEG with the drawings that the options select. Takes as long as
    /// keeping it, and stops when `is_cancelled` returns true.
    ///
    /// # Errors
    /// [`StoredFrameError`] for data that [`StoredFrame::new`] has not made.
    pub fn annotated(
        &self,
        options: &AnnotationOptions,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<Vec<u8>, StoredFrameError> {
        let sketch: Sketch = serde_json::from_slice(&self.sketch)?;
        let frame = decode(&self.jpeg, &DecodeLimits::default())?.frame;
        Ok(drawn(
            Arc::new(frame),
            &sketch,
            ImageFormat::Jpeg,
            options,
            is_cancelled,
        )?)
    }
}

fn is_kept_as_it_is(encoded: &[u8], frame: &Frame) -> bool {
    encoded.starts_with(JPEG_START) && encoded.len() <= MAX_BYTES && frame.width() <= WIDTHS[0]
}

/// Encodes a frame as JPEG, scaled down until it is small enough.
fn jpeg_of(frame: &Frame) -> Result<Bytes, StoredFrameError> {
    for width in WIDTHS {
        let jpeg = if frame.width() > width {
            encode_jpeg(&narrowed(frame, width), QUALITY)?
        } else {
            encode_jpeg(frame, QUALITY)?
        };
        if jpeg.len() <= MAX_BYTES {
            return Ok(jpeg.into());
        }
    }
    Err(StoredFrameError::TooLarge)
}

//! A frame that is kept with what can be drawn into it, so that it can be drawn later, elsewhere and
//! as whoever asks wants it.

use std::sync::Arc;

use bytes::Bytes;
use strum::VariantArray;

use super::{Layer, PictureError, PictureFormat, PictureOptions, drawn, sketch::Sketch};
use crate::{
    imaging::{
        Frame,
        annotate::{EncodeError, encode_jpeg},
        decode::{DecodeError, DecodeLimits, decode},
        narrowed,
    },
    pipeline::Detected,
};

/// Frames that are wider are made as narrow as the first of these; as the next one if their files are too
/// large then.
const WIDTHS: [u32; 3] = [2560, 1280, 640];
/// Hardly to be told from the original, also when it was drawn into and encoded again.
const QUALITY: u8 = 92;
/// 4 MiB: a frame that no camera delivers.
const MAX_BYTES: usize = 4 << 20;

/// How a JPEG begins (ITU-T T.81, B.2.1).
const JPEG_START: [u8; 2] = [0xFF, 0xD8];

/// A frame as it was looked at: masked where the calibration says so.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeptFrame {
    /// The frame, 4 MiB at most.
    pub jpeg: Bytes,
    /// What can be drawn into it, JSON.
    pub sketch: Bytes,
}

/// A kept frame that is none.
#[derive(Debug, thiserror::Error)]
pub enum KeptFrameError {
    /// What can be drawn cannot be read or written.
    #[error("what can be drawn into a kept frame is no such thing: {0}")]
    Sketch(#[from] serde_json::Error),
    /// The frame cannot be read.
    #[error("a kept frame cannot be read: {0}")]
    Frame(#[from] DecodeError),
    /// The frame cannot be written.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The picture cannot be drawn.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The frame is too large however narrow it is made.
    #[error("a frame takes more than {MAX_BYTES} bytes as a JPEG of {} pixels across", WIDTHS[2])]
    TooLarge,
}

impl KeptFrame {
    /// What is kept of a frame: the JPEG it came as, if that is small enough and nothing of it is hidden,
    /// or else one that is made of it. That takes tens of milliseconds for a large one: keep it off the
    /// async runtime.
    ///
    /// # Errors
    /// [`KeptFrameError`] for a frame that cannot be kept.
    pub fn of(detected: &Detected) -> Result<Self, KeptFrameError> {
        let sketch = Sketch::of(detected, Layer::VARIANTS).rounded();
        let sketch = serde_json::to_vec(&sketch)?.into();
        let jpeg = match &detected.encoded {
            Some(encoded) if is_kept_as_it_is(encoded, &detected.frame) => {
                // Not with all of the body that it was part of.
                Bytes::copy_from_slice(encoded)
            }
            _ => jpeg_of(&detected.frame)?,
        };
        Ok(Self { jpeg, sketch })
    }

    /// The frame with what the options want drawn into it, as JPEG. Takes as long as keeping it, and
    /// stops when `is_cancelled` returns true.
    ///
    /// # Errors
    /// [`KeptFrameError`] for what was not made by [`KeptFrame::of`].
    pub fn annotated(
        &self,
        options: &PictureOptions,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<Vec<u8>, KeptFrameError> {
        let sketch: Sketch = serde_json::from_slice(&self.sketch)?;
        let frame = decode(&self.jpeg, &DecodeLimits::default())?.frame;
        Ok(drawn(
            Arc::new(frame),
            &sketch,
            PictureFormat::Jpeg,
            options,
            is_cancelled,
        )?)
    }
}

fn is_kept_as_it_is(encoded: &[u8], frame: &Frame) -> bool {
    encoded.starts_with(&JPEG_START) && encoded.len() <= MAX_BYTES && frame.width() <= WIDTHS[0]
}

/// A frame as a JPEG, as narrow as it must be.
fn jpeg_of(frame: &Frame) -> Result<Bytes, KeptFrameError> {
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
    Err(KeptFrameError::TooLarge)
}

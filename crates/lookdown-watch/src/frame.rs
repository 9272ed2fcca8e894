//! One encoded frame of a camera.

use std::time::Instant;

use bytes::Bytes;
use jiff::Timestamp;
use lookdown_common::{JPEG_END, JPEG_START, PPM_START, jpeg_length, ppm_length};

use crate::memory_budget::Reservation;

/// Largest frame in bytes: an uncompressed-looking JPEG of 50 megapixels fits.
pub const MAX_FRAME_BYTES: usize = 32 << 20;

/// First bytes of a PNG.
const PNG_START: &[u8] = b"\x89PNG\r\n\x1a\n";
/// Last bytes of a PNG.
const PNG_END: &[u8] = b"IEND\xaeB`\x82";

/// The image format of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageFormat {
    /// JPEG.
    Jpeg,
    /// PNG.
    Png,
    /// WebP.
    WebP,
    /// Binary PPM: the pixels of a video.
    Ppm,
}

impl ImageFormat {
    /// The media type of the format.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Jpeg => "image/jpeg",
            Self::Png => "image/png",
            Self::WebP => "image/webp",
            Self::Ppm => "image/x-portable-pixmap",
        }
    }
}

/// A complete image file of a camera, not decoded.
#[derive(Debug, Clone)]
pub struct Frame {
    /// The image file. It counts against the budget of all frames until its last clone is dropped.
    pub image: Bytes,
    /// Its format.
    pub format: ImageFormat,
    /// The time at which the frame was captured, or received if the camera does not report it.
    pub captured_at: Timestamp,
    /// The time at which the frame was received.
    pub received: Instant,
}

/// The reason why bytes are not a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// Another file format.
    #[error("the camera sent no JPEG, PNG or WebP image")]
    NotAnImage,
    /// The end is missing.
    #[error("the image ends early")]
    Incomplete,
    /// The frames of all cameras exceed their budget.
    #[error("the frames of all cameras together take more than 512 MiB")]
    Memory,
}

impl Frame {
    /// Checks that the bytes are a whole image file that was captured at this time.
    ///
    /// # Errors
    /// [`FrameError`] if they are another file, or the end is missing.
    pub fn new(image: Bytes, captured_at: Timestamp) -> Result<Self, FrameError> {
        let format = format_of(&image)?;
        let image = Reservation::default().hold(image);
        Ok(Self {
            image: image.map_err(|_| FrameError::Memory)?,
            format,
            captured_at,
            received: Instant::now(),
        })
    }
}

/// Returns the format of an image file with its end.
fn format_of(image: &[u8]) -> Result<ImageFormat, FrameError> {
    // Some cameras pad their files.
    let padded = |byte: &u8| matches!(byte, 0 | b'\r' | b'\n');
    let length = image.iter().rposition(|byte| !padded(byte)).unwrap_or(0);
    let trimmed = image.get(..=length).unwrap_or_default();
    let whole = |format, is_whole| {
        if is_whole {
            Ok(format)
        } else {
            Err(FrameError::Incomplete)
        }
    };
    if image.starts_with(JPEG_START) {
        let is_whole = trimmed.ends_with(JPEG_END) || jpeg_length(image).is_some();
        whole(ImageFormat::Jpeg, is_whole)
    } else if image.starts_with(PNG_START) {
        whole(ImageFormat::Png, trimmed.ends_with(PNG_END))
    } else if image.starts_with(b"RIFF") && image.get(8..12) == Some(b"WEBP") {
        let size = image.get(4..8).and_then(|size| size.try_into().ok());
        let size = size.map_or(0, u32::from_le_bytes) as usize;
        whole(ImageFormat::WebP, image.len() >= size + 8)
    } else if image.starts_with(PPM_START) {
        let is_whole = ppm_length(image).is_some_and(|length| image.len() >= length);
        whole(ImageFormat::Ppm, is_whole)
    } else {
        Err(FrameError::NotAnImage)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(image: &[u8]) -> Result<ImageFormat, FrameError> {
        Frame::new(Bytes::copy_from_slice(image), Timestamp::UNIX_EPOCH).map(|frame| frame.format)
    }

    #[test]
    fn whole_images_are_recognized() {
        let webp = b"RIFF\x04\0\0\0WEBP";
        assert_eq!(check(b"\xff\xd8\xff\xe0..\xff\xd9"), Ok(ImageFormat::Jpeg));
        assert_eq!(
            check(b"\xff\xd8\xff..\xff\xd9\0\0\r\n"),
            Ok(ImageFormat::Jpeg)
        );
        assert_eq!(
            check(b"\x89PNG\r\n\x1a\n..IEND\xaeB`\x82"),
            Ok(ImageFormat::Png)
        );
        assert_eq!(check(b"P6\n1 2\n255\nrgbrgb"), Ok(ImageFormat::Ppm));
        assert_eq!(check(webp), Ok(ImageFormat::WebP));
    }

    #[test]
    fn images_without_an_end_are_incomplete() {
        for image in [
            b"\xff\xd8\xff\xe0..".as_slice(),
            b"\x89PNG\r\n\x1a\n..",
            b"RIFF\x05\0\0\0WEBP",
            b"P6\n1 2\n255\nrgbrg",
            b"P6\n1 2",
        ] {
            assert_eq!(check(image), Err(FrameError::Incomplete));
        }
    }

    #[test]
    fn other_files_are_no_images() {
        for file in [b"".as_slice(), b"<html>", b"GIF89a", b"\0\0\0\0"] {
            assert_eq!(check(file), Err(FrameError::NotAnImage));
        }
    }
}

//! Reasons to refuse an image. The sender can fix all of them.

/// The bytes cannot be decoded as an image.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// There are no bytes.
    #[error("the image is empty (0 bytes): send the bytes of a JPEG, PNG or WebP image")]
    Empty,
    /// The bytes are not in a supported format, or an unsupported kind of one.
    #[error("the image is {found}: send a JPEG, PNG or WebP image")]
    UnsupportedFormat {
        /// Description of the bytes that completes the sentence "the image is …".
        found: String,
    },
    /// The bytes start like an image but cannot be decoded to the end.
    #[error("the {format} image is damaged or cut off ({reason}): send the whole file again")]
    Corrupt {
        /// `JPEG`, `PNG` or `WebP`.
        format: &'static str,
        /// Reason of the failure.
        reason: String,
    },
    /// The image exceeds a limit.
    #[error("the image is {width}×{height} pixels; {limit}")]
    TooLarge {
        /// Stored width in pixels.
        width: u32,
        /// Stored height in pixels.
        height: u32,
        /// The limit it exceeds.
        limit: ExceededLimit,
    },
}

/// The limit that an image exceeds, and the remedy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ExceededLimit {
    /// A side is too long.
    #[error(
        "at most {max_width}×{max_height} is accepted: \
         send a smaller image or raise limits.max_image_side"
    )]
    Side {
        /// Greatest width in pixels.
        max_width: u32,
        /// Greatest height in pixels.
        max_height: u32,
    },
    /// There are too many pixels in all.
    #[error(
        "at most {max_pixels} pixels in all are accepted: \
         send a smaller image or raise limits.max_image_pixels"
    )]
    Pixels {
        /// Greatest number of pixels.
        max_pixels: u64,
    },
    /// The decoded image would take too much memory.
    #[error(
        "at most {max_bytes} bytes may be used to decode it: \
         send a smaller image or raise limits.max_decode_bytes"
    )]
    Memory {
        /// Greatest number of bytes.
        max_bytes: u64,
    },
}

//! Decodes untrusted bytes to a [`Frame`], within limits that are checked before any pixel is
//! decoded.
//!
//! The format is detected from the content, because file names and content types are unreliable.

mod container;

use std::{borrow::Cow, io::Cursor};

use image::{
    ColorType, DynamicImage, ImageDecoder, ImageError, ImageFormat, Limits, RgbImage,
    codecs::{jpeg::JpegDecoder, png::PngDecoder, pnm::PnmDecoder, webp::WebPDecoder},
    error::{LimitError, LimitErrorKind},
    metadata::Orientation,
};
use lookdown_common::{JPEG_END, PPM_START, jpeg_length};

use crate::{buffer_pool, frame::Frame};

/// Memory of the PNG decoder that does not depend on the size of the image.
const PNG_OVERHEAD_BYTES: u64 = 1 << 20;
/// Most bytes of a pixel: RGBA with 16 bits a sample.
const MAX_PIXEL_BYTES: u64 = 8;

/// Size limits of an image. All of them hold at once and are checked against the image's header,
/// before its pixels are decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DecodeLimits {
    /// Greatest width in pixels, as stored (before the EXIF orientation is applied).
    pub max_width: u32,
    /// Greatest height in pixels, as stored.
    pub max_height: u32,
    /// Greatest total number of pixels.
    pub max_pixels: u64,
    /// Greatest size of the decoded image and its RGB copy together. The decoders need at most 8
    /// bytes a pixel in addition.
    pub max_alloc_bytes: u64,
}

impl Default for DecodeLimits {
    /// 8192 pixels a side, 50 megapixels, 512 MiB.
    fn default() -> Self {
        Self {
            max_width: 8192,
            max_height: 8192,
            max_pixels: 50_000_000,
            max_alloc_bytes: 512 * 1024 * 1024,
        }
    }
}

impl DecodeLimits {
    /// Checks the width and the height of an image, pixels.
    ///
    /// # Errors
    /// [`DecodeError::TooLarge`].
    pub fn check(&self, (width, height): (u32, u32)) -> Result<(), DecodeError> {
        let Self {
            max_width,
            max_height,
            max_pixels,
            ..
        } = *self;
        let limit = if width > max_width || height > max_height {
            ExceededLimit::Side {
                max_width,
                max_height,
            }
        } else if u64::from(width) * u64::from(height) > max_pixels {
            ExceededLimit::Pixels { max_pixels }
        } else {
            return Ok(());
        };
        Err(DecodeError::TooLarge {
            width,
            height,
            limit,
        })
    }
}

/// A decoded, upright image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DecodedFrame {
    /// The pixels, after the EXIF orientation was applied.
    pub frame: Frame,
    /// True if the EXIF orientation requires a rotation or a flip, so that the frame differs from
    /// the stored pixels.
    pub orientation_applied: bool,
}

/// Decodes a JPEG, PNG, WebP or binary PPM image to RGB.
///
/// The EXIF orientation is applied. Transparent pixels are blended over black, like the surround of
/// a lens. 16-bit samples are rounded to 8 bits. Of an animation, the first frame is used. A
/// truncated file is refused, even where a lenient decoder would fill the missing rows with gray.
///
/// # Errors
/// See [`DecodeError`]. No input causes a panic.
pub fn decode(bytes: &[u8], limits: &DecodeLimits) -> Result<DecodedFrame, DecodeError> {
    if bytes.is_empty() {
        return Err(DecodeError::Empty);
    }
    match image::guess_format(bytes) {
        Ok(ImageFormat::Jpeg) => decode_jpeg(bytes, limits),
        Ok(ImageFormat::Png) => decode_png(bytes, limits),
        Ok(ImageFormat::WebP) => decode_webp(bytes, limits),
        Ok(ImageFormat::Pnm) if bytes.starts_with(PPM_START) => decode_ppm(bytes, limits),
        Ok(other) => {
            let name = other.extensions_str().first().copied().unwrap_or("unknown");
            Err(unsupported(format!(
                "in the format {}",
                name.to_uppercase()
            )))
        }
        Err(_) if container::is_heif(bytes) => Err(unsupported("in the format HEIF")),
        Err(_) => Err(unsupported(container::name_of_other(bytes))),
    }
}

/// Returns the width and the height that the header of an image states, without decoding a pixel.
/// `None` if the header cannot be read.
pub fn declared_size(bytes: &[u8]) -> Option<(u32, u32)> {
    match image::guess_format(bytes).ok()? {
        ImageFormat::Jpeg => Some(JpegDecoder::new(Cursor::new(bytes)).ok()?.dimensions()),
        ImageFormat::Png => container::png_size(bytes),
        ImageFormat::WebP => Some(WebPDecoder::new(Cursor::new(bytes)).ok()?.dimensions()),
        ImageFormat::Pnm if bytes.starts_with(PPM_START) => {
            Some(PnmDecoder::new(bytes).ok()?.dimensions())
        }
        _ => None,
    }
}

fn decode_jpeg(bytes: &[u8], limits: &DecodeLimits) -> Result<DecodedFrame, DecodeError> {
    let task = Task::new("JPEG", limits);
    let head = JpegHead::new(bytes);
    if let Some(kind) = head.unsupported_kind() {
        return Err(unsupported(kind));
    }
    let bytes = &*head.with_huffman_tables(bytes);
    let decoder = JpegDecoder::new(Cursor::new(bytes)).map_err(|e| task.refusal(e))?;
    limits.check(decoder.dimensions())?;
    let length = jpeg_length(bytes).ok_or_else(|| task.corrupt("the file ends early"))?;
    if bytes[..length].ends_with(JPEG_END) {
        return task.read(decoder);
    }
    let ended = [&bytes[..length], JPEG_END].concat();
    task.read(JpegDecoder::new(Cursor::new(&*ended)).map_err(|e| task.refusal(e))?)
}

fn decode_png(bytes: &[u8], limits: &DecodeLimits) -> Result<DecodedFrame, DecodeError> {
    let task = Task::new("PNG", limits);
    let size = container::png_size(bytes);
    let (width, height) = size.ok_or_else(|| task.corrupt("its header is incomplete"))?;
    limits.check((width, height))?;
    let essence = container::png_essence(bytes);
    let essence = essence.ok_or_else(|| task.corrupt("the file ends early"))?;
    let mut memory = Limits::no_limits();
    let pixels = u64::from(width) * u64::from(height);
    memory.max_alloc = Some(PNG_OVERHEAD_BYTES + pixels * MAX_PIXEL_BYTES);
    let decoder = PngDecoder::with_limits(Cursor::new(essence.as_slice()), memory);
    task.read(decoder.map_err(|e| task.refusal(e))?)
}

fn decode_webp(bytes: &[u8], limits: &DecodeLimits) -> Result<DecodedFrame, DecodeError> {
    let task = Task::new("WebP", limits);
    let decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(|e| task.refusal(e))?;
    let size = decoder.dimensions();
    limits.check(size)?;
    task.require(container::webp_is_whole(bytes), "the file ends early")?;
    task.require(
        container::webp_frames_fit(bytes, size),
        "a frame is larger than the image",
    )?;
    task.read(decoder)
}

/// Decodes pixels that `ffmpeg` wrote.
fn decode_ppm(bytes: &[u8], limits: &DecodeLimits) -> Result<DecodedFrame, DecodeError> {
    let task = Task::new("PPM", limits);
    let decoder = PnmDecoder::new(bytes).map_err(|e| task.refusal(e))?;
    limits.check(decoder.dimensions())?;
    task.read(decoder)
}

/// One decoding, with the data for its checks and errors.
struct Task<'a> {
    format: &'static str,
    limits: &'a DecodeLimits,
}

impl<'a> Task<'a> {
    fn new(format: &'static str, limits: &'a DecodeLimits) -> Self {
        Self { format, limits }
    }

    fn require(&self, holds: bool, otherwise: &str) -> Result<(), DecodeError> {
        if holds {
            Ok(())
        } else {
            Err(self.corrupt(otherwise))
        }
    }

    fn read(&self, mut decoder: impl ImageDecoder) -> Result<DecodedFrame, DecodeError> {
        let (width, height) = decoder.dimensions();
        let rgb_bytes = u64::from(width) * u64::from(height) * 3;
        if decoder.total_bytes().saturating_add(rgb_bytes) > self.limits.max_alloc_bytes {
            return Err(DecodeError::TooLarge {
                width,
                height,
                limit: ExceededLimit::Memory {
                    max_bytes: self.limits.max_alloc_bytes,
                },
            });
        }
        let exif = decoder.exif_metadata().map_err(|e| self.refusal(e))?;
        let orientation = exif.as_deref().and_then(container::exif_orientation);
        let orientation = orientation.unwrap_or(Orientation::NoTransforms);
        let image = read(decoder).map_err(|e| self.refusal(e))?;
        let mut upright = DynamicImage::ImageRgb8(rgb_over_black(image));
        upright.apply_orientation(orientation);
        let (width, height) = (upright.width(), upright.height());
        let frame = Frame::new(width, height, upright.into_bytes())
            .map_err(|e| self.corrupt(e.to_string()))?;
        Ok(DecodedFrame {
            frame,
            orientation_applied: orientation != Orientation::NoTransforms,
        })
    }

    fn corrupt(&self, reason: impl Into<String>) -> DecodeError {
        DecodeError::Corrupt {
            format: self.format,
            reason: reason.into(),
        }
    }

    fn refusal(&self, error: ImageError) -> DecodeError {
        match error {
            ImageError::Unsupported(reason) => {
                unsupported(format!("an unsupported kind of {} ({reason})", self.format))
            }
            other => self.corrupt(other.to_string().trim()),
        }
    }
}

/// Like `DynamicImage::from_decoder`, but reuses the memory of earlier frames for 8-bit RGB images.
fn read(decoder: impl ImageDecoder) -> Result<DynamicImage, ImageError> {
    if decoder.color_type() != ColorType::Rgb8 {
        return DynamicImage::from_decoder(decoder);
    }
    let (width, height) = decoder.dimensions();
    let too_large = || ImageError::Limits(LimitError::from_kind(LimitErrorKind::DimensionError));
    let bytes = usize::try_from(decoder.total_bytes()).map_err(|_| too_large())?;
    let pixels = buffer_pool::zeros(bytes);
    let mut image = RgbImage::from_raw(width, height, pixels).ok_or_else(too_large)?;
    decoder.read_image(&mut image)?;
    Ok(DynamicImage::ImageRgb8(image))
}

fn unsupported(found: impl Into<String>) -> DecodeError {
    DecodeError::UnsupportedFormat {
        found: found.into(),
    }
}

/// Blends transparent parts over black, the color around a lens circle.
fn rgb_over_black(image: DynamicImage) -> RgbImage {
    if !image.color().has_alpha() {
        return image.into_rgb8();
    }
    let rgba = image.into_rgba8();
    let over_black = |value: u8, alpha: u8| {
        let rounded = (u16::from(value) * u16::from(alpha) + 127) / 255;
        u8::try_from(rounded).unwrap_or(u8::MAX)
    };
    RgbImage::from_fn(rgba.width(), rgba.height(), |x, y| {
        let [red, green, blue, alpha] = rgba.get_pixel(x, y).0;
        image::Rgb([red, green, blue].map(|value| over_black(value, alpha)))
    })
}

/// The application segment of JPEG files in AVI: its decoders use the tables of annex K.3 where a
/// file has none.
const OF_AVI: [u8; 18] = *b"\xFF\xE0\x00\x10AVI1\0\0\0\0\0\0\0\0\0\0";

/// The facts of the head that decide about decoding.
#[derive(Debug, Default)]
struct JpegHead {
    /// The marker of the frame and the bits of a sample.
    frame: Option<(u8, u8)>,
    has_huffman_tables: bool,
}

impl JpegHead {
    /// Reads the head. It ends at the first bytes that are not a segment.
    fn new(bytes: &[u8]) -> Self {
        let mut head = Self::default();
        let mut rest = bytes.get(2..).unwrap_or_default();
        while let [0xFF, marker, high, low, payload @ ..] = rest {
            let length = match marker {
                // A fill byte, and markers without a payload.
                0xFF => 1,
                0x01 | 0xD0..=0xD8 => 2,
                _ => 2 + usize::from(u16::from_be_bytes([*high, *low])),
            };
            match marker {
                0xC4 => head.has_huffman_tables = true,
                0xC0..=0xC3 | 0xC5..=0xC7 | 0xC9..=0xCB | 0xCD..=0xCF | 0xF7 => {
                    head.frame = payload.first().map(|bits| (*marker, *bits));
                }
                0xDA => break,
                _ => {}
            }
            rest = rest.get(length..).unwrap_or_default();
        }
        head
    }

    /// Returns the kind of the JPEG, if no decoder here reads it.
    fn unsupported_kind(&self) -> Option<String> {
        let (marker, bits) = self.frame?;
        let kind = match marker {
            0xC3 | 0xF7 => "a lossless",
            0xC5..=0xC7 => "a hierarchical",
            0xC9..=0xCF => "an arithmetic coded",
            _ if bits != 8 => return Some(format!("a JPEG with {bits} bits per sample")),
            _ => return None,
        };
        Some(format!("{kind} JPEG"))
    }

    /// Returns the file with the standard Huffman tables, if it has none: USB cameras leave them
    /// out.
    fn with_huffman_tables<'a>(&self, bytes: &'a [u8]) -> Cow<'a, [u8]> {
        let is_baseline = matches!(self.frame, Some((0xC0 | 0xC1, _)));
        match bytes.split_at_checked(2) {
            Some((start, rest)) if is_baseline && !self.has_huffman_tables => {
                [start, &OF_AVI, rest].concat().into()
            }
            _ => bytes.into(),
        }
    }
}

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
        /// `JPEG`, `PNG`, `WebP` or `PPM`.
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

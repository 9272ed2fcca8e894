//! Checks of an image's container structure before any pixel is decoded.
//!
//! The decoders are too lenient for a service. The JPEG decoder fills the missing rows of a
//! truncated file with gray. The PNG decoder reports the size only when it reaches the pixels. The
//! WebP decoder allocates memory for an inner frame before it compares that frame with the canvas.
//! The functions here close those gaps. They only skip over lengths and never read outside the
//! bytes.

use image::metadata::Orientation;

/// Returns true if the bytes begin like HEIF/HEIC, a format of telephones.
pub(super) fn is_heif(bytes: &[u8]) -> bool {
    bytes.get(4..8) == Some(b"ftyp")
        && matches!(
            bytes.get(8..12),
            Some(b"heic" | b"heix" | b"hevc" | b"mif1" | b"msf1")
        )
}

/// Returns what clients send instead of the bytes of an image, as the end of a sentence.
pub(super) fn name_of_text(bytes: &[u8]) -> &'static str {
    /// The beginnings of images, also in the alphabet for URLs, and percent-encoded.
    const BASE64: [&[u8]; 6] = [
        b"data:image/",
        b"/9j/",
        b"_9j_",
        b"%2F9j%2F",
        b"iVBORw0",
        b"UklGR",
    ];
    /// Bytes that are searched: names of form fields may come before.
    const BEGIN: usize = 64;
    let text = bytes.trim_ascii_start();
    let begin = &text[..text.len().min(BEGIN)];
    let contains = |part: &&[u8]| begin.windows(part.len()).any(|window| window == *part);
    if text.starts_with(b"{") || text.starts_with(b"[") {
        "JSON and not the bytes of a file"
    } else if BASE64.iter().any(contains) {
        "base64 text and not its bytes"
    } else if begin.starts_with(b"ffd8ff") || begin.starts_with(b"FFD8FF") {
        "hexadecimal text and not its bytes"
    } else if bytes.starts_with(&[0x1F, 0x8B]) {
        "compressed with gzip"
    } else {
        "not in a known image format"
    }
}

/// Width and height from a PNG's header chunk, which always comes first (PNG specification, section
/// 11.2.1).
pub(super) fn png_size(bytes: &[u8]) -> Option<(u32, u32)> {
    if bytes.get(12..16)? != b"IHDR" {
        return None;
    }
    let side = |at: usize| Some(u32::from_be_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    Some((side(16)?, side(20)?))
}

/// Returns a PNG without the chunks that its pixels do not need, `None` if it has no end chunk.
///
/// Profiles and texts are compressed a thousandfold, and the decoder would keep each. The frames of
/// an animation after the first one are left out, too.
pub(super) fn png_essence(bytes: &[u8]) -> Option<Vec<u8>> {
    let (signature, mut rest) = bytes.split_at_checked(8)?;
    let mut essence = signature.to_vec();
    while let [l0, l1, l2, l3, kind @ ..] = rest {
        let payload = u32::from_be_bytes([*l0, *l1, *l2, *l3]) as usize;
        // Length, name, payload and checksum.
        let (chunk, next) = rest.split_at_checked(payload.saturating_add(12))?;
        let name = kind.get(..4)?;
        // The name of a chunk that is needed to show the image begins with a capital letter.
        if name[0].is_ascii_uppercase() || name == b"tRNS" || name == b"eXIf" {
            essence.extend_from_slice(chunk);
        }
        if name == b"IEND" {
            return Some(essence);
        }
        rest = next;
    }
    None
}

/// Returns the orientation of an EXIF block (TIFF 6.0, section 2; Exif 2.32, tag 0x0112), whatever
/// the type of the integer.
pub(super) fn exif_orientation(exif: &[u8]) -> Option<Orientation> {
    const ORIENTATION: u32 = 0x0112;
    let is_little = match exif.get(..4)? {
        b"II*\0" => true,
        b"MM\0*" => false,
        _ => return None,
    };
    let number = |at: usize, length: usize| {
        let bytes = exif.get(at..at.checked_add(length)?)?.iter();
        let add = |sum: u32, byte: &u8| sum << 8 | u32::from(*byte);
        Some(if is_little {
            bytes.rev().fold(0, add)
        } else {
            bytes.fold(0, add)
        })
    };
    let first = number(4, 4)? as usize;
    let mut entries = (0..number(first, 2)? as usize).map(|index| first + 2 + 12 * index);
    let entry = entries.find(|entry| number(*entry, 2) == Some(ORIENTATION))?;
    // Unsigned and signed integers of 1, 2 and 4 bytes.
    let length = match number(entry + 2, 2)? {
        1 | 6 => 1,
        3 | 8 => 2,
        4 | 9 => 4,
        _ => return None,
    };
    Orientation::from_exif(number(entry + 8, length)?.try_into().ok()?)
}

/// Returns true if a WebP has all the bytes announced by its RIFF header.
pub(super) fn webp_is_whole(bytes: &[u8]) -> bool {
    let announced = bytes
        .get(4..8)
        .and_then(|size| Some(u32::from_le_bytes(size.try_into().ok()?)));
    announced.is_some_and(|size| bytes.len() as u64 >= u64::from(size) + 8)
}

/// Returns true if no lossy frame of a WebP is larger than the canvas announced by its header (RFC
/// 9649, section 2).
pub(super) fn webp_frames_fit(bytes: &[u8], (width, height): (u32, u32)) -> bool {
    const ANIMATION_FRAME_HEADER: usize = 16;
    chunks(bytes.get(12..).unwrap_or_default()).all(|(name, payload)| match &name {
        b"ANMF" => chunks(payload.get(ANIMATION_FRAME_HEADER..).unwrap_or_default())
            .filter(|(name, _)| name == b"VP8 ")
            .all(|(_, payload)| lossy_frame_fits(payload, width, height)),
        b"VP8 " => lossy_frame_fits(payload, width, height),
        _ => true,
    })
}

/// Sizes are 14 bits wide and follow a 3-byte tag and a 3-byte start code
/// (RFC 6386, section 9.1).
fn lossy_frame_fits(payload: &[u8], width: u32, height: u32) -> bool {
    match payload {
        [_, _, _, _, _, _, w0, w1, h0, h1, ..] => {
            u32::from(u16::from_le_bytes([*w0, *w1]) & 0x3FFF) <= width
                && u32::from(u16::from_le_bytes([*h0, *h1]) & 0x3FFF) <= height
        }
        _ => false,
    }
}

/// Name and payload of each RIFF chunk. The last one may be cut off.
fn chunks(mut bytes: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    std::iter::from_fn(move || {
        let [n0, n1, n2, n3, s0, s1, s2, s3, rest @ ..] = bytes else {
            return None;
        };
        let size = u32::from_le_bytes([*s0, *s1, *s2, *s3]) as usize;
        // Chunks are padded to an even length.
        bytes = rest.get(size.next_multiple_of(2)..).unwrap_or_default();
        let payload = rest.get(..size).unwrap_or(rest);
        Some(([*n0, *n1, *n2, *n3], payload))
    })
}

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

const VIDEO: &str = "a video and not one of its frames";
const PATH: &str = "a path or an address and not the bytes of the file";
const HEXADECIMAL: &str = "hexadecimal text and not its bytes";
/// Files and texts that clients send instead of an image: a position, the bytes there, and the end
/// of a sentence.
const OTHERS: [(usize, &[u8], &str); 30] = [
    (4, b"jP  ", "in the format JPEG 2000"),
    (0, b"\xff\x4f\xff\x51", "in the format JPEG 2000"),
    (4, b"JXL ", "in the format JPEG XL"),
    (0, b"\xff\x0a", "in the format JPEG XL"),
    (0, b"II\xbc", "in the format JPEG XR"),
    (0, b"II+\0", "in the format TIFF"),
    (0, b"8BPS", "in the format of Photoshop"),
    (4, b"ftyp", VIDEO),
    (8, b"AVI ", VIDEO),
    (0, b"\x1a\x45\xdf\xa3", VIDEO),
    (0, b"FLV", VIDEO),
    // The start code of H.264 and H.265.
    (0, b"\0\0\0\x01", VIDEO),
    (0, b"%PDF", "a PDF document"),
    (0, b"PK\x03\x04", "an archive"),
    (0, b"<svg", "in the format SVG"),
    (0, b"<", "a web page or XML"),
    (
        0,
        b"[object ",
        "the name of an object and not the bytes of a file",
    ),
    (0, b"{", "JSON and not the bytes of a file"),
    (0, b"[", "JSON and not the bytes of a file"),
    (0, b"ffd8ff", HEXADECIMAL),
    (0, b"FFD8FF", HEXADECIMAL),
    (0, b"0xff", HEXADECIMAL),
    (0, b"ff d8 ff", HEXADECIMAL),
    (0, b"b'\\x", "the notation of Python and not its bytes"),
    (0, b"=FF=D8", "quoted-printable text and not its bytes"),
    (0, b"http://", PATH),
    (0, b"https://", PATH),
    (0, b"/", PATH),
    (0, b"@", PATH),
    (1, b":\\", PATH),
];

/// Returns what clients send instead of the bytes of an image, as the end of a sentence.
pub(super) fn name_of_other(bytes: &[u8]) -> &'static str {
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
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = text.trim_ascii_start();
    let begin = &text[..text.len().min(BEGIN)];
    let contains = |part: &&[u8]| begin.windows(part.len()).any(|window| window == *part);
    let is_json = text.starts_with(b"{") || text.starts_with(b"[");
    if !is_json && BASE64.iter().any(contains) {
        "base64 text and not its bytes"
    } else if bytes.starts_with(&[0x1F, 0x8B]) {
        "compressed with gzip"
    } else {
        let is_there = |(at, part, _): &&(usize, &[u8], _)| {
            text.get(*at..).is_some_and(|rest| rest.starts_with(part))
        };
        let other = OTHERS.iter().find(is_there);
        other.map_or("not in a known image format", |(.., name)| name)
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

/// The last chunk of a PNG.
const PNG_END: &[u8] = b"\0\0\0\0IEND\xae\x42\x60\x82";
/// The length of the signature with the first chunk, the header.
const PNG_HEADER_LENGTH: usize = 33;

/// Returns a PNG without the chunks that its pixels do not need, `None` if a chunk is cut off. An
/// end chunk that is missing is added, as the pixels show whether they are whole.
///
/// Profiles and texts are compressed a thousandfold, and the decoder would keep each. The frames of
/// an animation after the first one are left out, too. The orientation comes first, because the
/// decoder reads no chunk behind the pixels.
pub(super) fn png_essence(bytes: &[u8]) -> Option<Vec<u8>> {
    let (signature, mut rest) = bytes.split_at_checked(8)?;
    let mut essence = signature.to_vec();
    let mut has_exif = false;
    while let [l0, l1, l2, l3, kind @ ..] = rest
        && rest.len() >= PNG_END.len()
    {
        let payload = u32::from_be_bytes([*l0, *l1, *l2, *l3]) as usize;
        // Length, name, payload and checksum.
        let (chunk, next) = rest.split_at_checked(payload.saturating_add(12))?;
        let name = kind.get(..4)?;
        // The name of a chunk that is needed to show the image begins with a capital letter.
        if name == b"eXIf" && !has_exif && essence.len() >= PNG_HEADER_LENGTH {
            has_exif = true;
            let after_header = PNG_HEADER_LENGTH..PNG_HEADER_LENGTH;
            essence.splice(after_header, chunk.iter().copied());
        } else if name == b"IEND" {
            break;
        } else if name[0].is_ascii_uppercase() || name == b"tRNS" {
            essence.extend_from_slice(chunk);
        }
        rest = next;
    }
    essence.extend_from_slice(PNG_END);
    Some(essence)
}

/// Returns the orientation of an EXIF block (TIFF 6.0, section 2; Exif 2.32, tag 0x0112), whatever
/// the type of the integer.
pub(super) fn exif_orientation(exif: &[u8]) -> Option<Orientation> {
    const ORIENTATION: u32 = 0x0112;
    // Some programs write the prefix of JPEG into other formats.
    let exif = exif.strip_prefix(b"Exif\0\0").unwrap_or(exif);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_and_texts_of_a_png_are_left_out() {
        let chunk = |name: &[u8; 4]| [&[0, 0, 0, 13][..], name, &[0; 17]].concat();
        let names = [
            b"IHDR", b"iCCP", b"zTXt", b"iTXt", b"tEXt", b"IDAT", b"IEND",
        ];
        let chunks = names.map(chunk).concat();
        let essence = png_essence(&[b"\x89PNG\r\n\x1a\n", &chunks[..]].concat()).unwrap();
        let is_kept = |name: &&[u8; 4]| essence.windows(4).any(|window| window == *name);
        let kept: Vec<_> = names.iter().copied().filter(is_kept).collect();
        assert_eq!(kept, [b"IHDR", b"IDAT", b"IEND"]);
    }
}

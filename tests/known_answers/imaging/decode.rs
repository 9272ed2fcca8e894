//! Decoding of every accepted format, upright and in RGB, and refusal of everything else.

use lookdown_imaging::decode::{DecodeError, DecodeLimits, DecodedFrame, ExceededLimit, decode};
use proptest::prelude::*;

fn fixture(name: &str) -> Vec<u8> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/images/");
    std::fs::read(format!("{folder}{name}")).unwrap()
}

fn decoded(name: &str) -> DecodedFrame {
    decode(&fixture(name), &DecodeLimits::default())
        .unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn refused(bytes: &[u8]) -> DecodeError {
    decode(bytes, &DecodeLimits::default()).unwrap_err()
}

const IMAGES: [&str; 22] = [
    "alpha.png",
    "alpha.webp",
    "alpha_lossy.webp",
    "animated.webp",
    "cmyk.jpg",
    "grey.jpg",
    "grey.png",
    "grey_16_bit.png",
    "lossless.webp",
    "lossy.webp",
    "one_bit.png",
    "orientation_1.jpg",
    "orientation_6.jpg",
    "orientation_6.png",
    "orientation_6.webp",
    "palette.png",
    "palette_alpha.png",
    "progressive.jpg",
    "rgb.png",
    "rgb.ppm",
    "rgb_16_bit.png",
    "thumbnail.jpg",
];

/// Centers of the quarters of the image in every fixture.
const QUARTERS: [((u32, u32), [u8; 3]); 4] = [
    ((40, 8), [0, 255, 0]),
    ((8, 8), [255, 0, 0]),
    ((8, 24), [0, 0, 255]),
    ((40, 24), [255, 255, 255]),
];

fn assert_close(name: &str, actual: [u8; 3], expected: [u8; 3], tolerance: u8) {
    let near = actual
        .iter()
        .zip(expected)
        .all(|(a, e)| a.abs_diff(e) <= tolerance);
    assert!(near, "{name}: {actual:?} is not about {expected:?}");
}

fn assert_shows_the_quarters(name: &str, image: &DecodedFrame, tolerance: u8) {
    let frame = &image.frame;
    assert_eq!((frame.width(), frame.height()), (64, 32), "{name}");
    for ((x, y), color) in QUARTERS {
        assert_close(name, frame.pixel(x, y), color, tolerance);
    }
}

#[test]
fn every_color_format_decodes_to_the_same_image() {
    for name in [
        "rgb.png",
        "rgb.ppm",
        "rgb_16_bit.png",
        "palette.png",
        "lossless.webp",
        "animated.webp",
    ] {
        assert_shows_the_quarters(name, &decoded(name), 0);
    }
    for name in ["thumbnail.jpg", "progressive.jpg", "cmyk.jpg", "lossy.webp"] {
        assert_shows_the_quarters(name, &decoded(name), 4);
    }
}

#[test]
fn all_eight_exif_orientations_are_turned_upright() {
    let upright = fixture("orientation_1.jpg");
    let tag = [0x12, 0x01, 0x03, 0x00, 1, 0, 0, 0];
    let tag_at = upright.windows(8).position(|window| window == tag).unwrap();
    let [green, red, blue, white] = QUARTERS.map(|(_, color)| color);
    // The upper left, upper right, lower left and lower right quarters.
    for (orientation, quarters) in (1..).zip([
        [red, green, blue, white],
        [green, red, white, blue],
        [white, blue, green, red],
        [blue, white, red, green],
        [red, blue, green, white],
        [blue, red, white, green],
        [white, green, blue, red],
        [green, white, red, blue],
    ]) {
        let mut bytes = upright.clone();
        bytes[tag_at + 8] = orientation;
        let image = decode(&bytes, &DecodeLimits::default()).unwrap();
        let (width, height) = (image.frame.width(), image.frame.height());
        let is_turned = orientation > 4;
        assert_eq!((width, height), if is_turned { (32, 64) } else { (64, 32) });
        let [left, right] = [width / 4, width * 3 / 4];
        let [top, bottom] = [height / 4, height * 3 / 4];
        let centers = [(left, top), (right, top), (left, bottom), (right, bottom)];
        for ((x, y), color) in centers.into_iter().zip(quarters) {
            let name = format!("orientation {orientation}");
            assert_close(&name, image.frame.pixel(x, y), color, 4);
        }
        assert_eq!(image.orientation_applied, orientation != 1);
    }
}

#[test]
fn an_orientation_may_be_any_integer() {
    let bytes = fixture("orientation_6.jpg");
    let tag = [0x01, 0x12, 0x00, 0x03, 0, 0, 0, 1];
    let little = [0x12, 0x01, 0x03, 0x00, 1, 0, 0, 0];
    let find = |tag: [u8; 8]| bytes.windows(8).position(|window| window == tag);
    let (at, is_little) = match (find(tag), find(little)) {
        (Some(at), _) => (at, false),
        (None, at) => (at.unwrap(), true),
    };
    for (kind, value) in [
        (1_u16, [6, 0, 0, 0]),
        (6, [6, 0, 0, 0]),
        (3, [0, 6, 0, 0]),
        (8, [0, 6, 0, 0]),
        (4, [0, 0, 0, 6]),
        (9, [0, 0, 0, 6]),
    ] {
        let mut bytes = bytes.clone();
        let kind_bytes = if is_little {
            kind.to_le_bytes()
        } else {
            kind.to_be_bytes()
        };
        bytes[at + 2..at + 4].copy_from_slice(&kind_bytes);
        let value = if is_little { [6, 0, 0, 0] } else { value };
        bytes[at + 8..at + 12].copy_from_slice(&value);
        let image = decode(&bytes, &DecodeLimits::default()).unwrap();
        assert!(image.orientation_applied, "type {kind}");
    }
}

#[test]
fn memory_for_a_png_follows_its_pixels() {
    let mut bytes = fixture("rgb.png");
    // Chunks with a wrong checksum: the decoder would refuse those that it reads.
    for name in [b"iCCP", b"zTXt", b"iTXt", b"tEXt"] {
        let mut chunk = vec![0, 0, 0, 2];
        chunk.extend_from_slice(name);
        chunk.extend_from_slice(&[b'x', 0, 1, 2, 3, 4]);
        bytes.splice(33..33, chunk);
    }
    let image = decode(&bytes, &DecodeLimits::default()).unwrap();
    assert_eq!(image, decoded("rgb.png"));
}

#[test]
fn a_png_without_its_end_chunk_is_whole() {
    let bytes = fixture("rgb.png");
    for missing in [12, 6] {
        let image = decode(&bytes[..bytes.len() - missing], &DecodeLimits::default());
        assert_eq!(image.unwrap(), decoded("rgb.png"), "{missing}");
    }
}

#[test]
fn an_orientation_behind_the_pixels_of_a_png_is_read() {
    let mut bytes = fixture("orientation_6.png");
    let at = bytes.windows(4).position(|name| name == b"eXIf").unwrap() - 4;
    let payload = u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let chunk: Vec<u8> = bytes.drain(at..at + payload + 12).collect();
    let end = bytes.len() - 12;
    bytes.splice(end..end, chunk);
    let image = decode(&bytes, &DecodeLimits::default()).unwrap();
    assert_eq!(image, decoded("orientation_6.png"));
}

#[test]
fn png_and_webp_orientations_are_honoured_too() {
    for name in ["orientation_6.png", "orientation_6.webp"] {
        let image = decoded(name);
        assert_shows_the_quarters(name, &image, 0);
        assert!(image.orientation_applied, "{name}");
    }
}

#[test]
fn gray_images_become_rgb_and_sixteen_bits_become_eight() {
    for (name, tolerance) in [("grey.png", 0), ("grey.jpg", 4), ("grey_16_bit.png", 1)] {
        let image = decoded(name);
        for x in [0, 20, 63] {
            let level = u8::try_from(x * 4).unwrap();
            assert_close(name, image.frame.pixel(x, 9), [level; 3], tolerance);
        }
    }
    let image = decoded("one_bit.png");
    assert_eq!(image.frame.pixel(31, 0), [0; 3]);
    assert_eq!(image.frame.pixel(32, 0), [255; 3]);
}

#[test]
fn transparent_pixels_are_blended_over_black() {
    for (name, tolerance) in [
        ("alpha.png", 0),
        ("alpha.webp", 0),
        ("alpha_lossy.webp", 12),
    ] {
        let image = decoded(name);
        assert_close(name, image.frame.pixel(4, 4), [0, 0, 0], tolerance);
        assert_close(name, image.frame.pixel(24, 4), [128, 0, 0], tolerance);
        assert_close(name, image.frame.pixel(60, 4), [0, 255, 0], tolerance);
    }
    let image = decoded("palette_alpha.png");
    assert_eq!(image.frame.pixel(4, 4), [0; 3]);
    assert_eq!(image.frame.pixel(60, 4), [0, 255, 0]);
}

#[test]
fn zero_bytes_are_reported_as_empty() {
    assert_eq!(refused(b""), DecodeError::Empty);
}

#[test]
fn fifty_bytes_that_claim_ten_thousand_megapixels_are_too_large() {
    let bytes = fixture("huge.png");
    assert_eq!(bytes.len(), 50);
    assert_eq!(
        refused(&bytes).to_string(),
        "the image is 100000×100000 pixels; at most 8192×8192 is accepted: \
         send a smaller image or raise limits.max_image_side"
    );
}

#[test]
fn each_limit_holds_on_its_own_for_every_container() {
    let open = DecodeLimits::default();
    let cases = [
        (
            DecodeLimits {
                max_width: 63,
                ..open
            },
            ExceededLimit::Side {
                max_width: 63,
                max_height: open.max_height,
            },
        ),
        (
            DecodeLimits {
                max_height: 31,
                ..open
            },
            ExceededLimit::Side {
                max_width: open.max_width,
                max_height: 31,
            },
        ),
        (
            DecodeLimits {
                max_pixels: 2047,
                ..open
            },
            ExceededLimit::Pixels { max_pixels: 2047 },
        ),
        (
            DecodeLimits {
                max_alloc_bytes: 10_000,
                ..open
            },
            ExceededLimit::Memory { max_bytes: 10_000 },
        ),
    ];
    for name in [
        "rgb.png",
        "rgb.ppm",
        "progressive.jpg",
        "lossy.webp",
        "alpha.webp",
    ] {
        for (limits, limit) in cases {
            let expected = DecodeError::TooLarge {
                width: 64,
                height: 32,
                limit,
            };
            assert_eq!(decode(&fixture(name), &limits), Err(expected), "{name}");
        }
    }
}

#[test]
fn an_image_exactly_at_its_limits_is_accepted() {
    let limits = DecodeLimits {
        max_width: 64,
        max_height: 32,
        max_pixels: 2048,
        max_alloc_bytes: 12_288,
    };
    assert!(decode(&fixture("rgb.png"), &limits).is_ok());
}

#[test]
fn the_format_is_detected_from_content_and_others_are_named() {
    let found = |bytes: &[u8]| match refused(bytes) {
        DecodeError::UnsupportedFormat { found } => found,
        other => panic!("{other}"),
    };
    assert_eq!(found(b"GIF89a\x40\0\x20\0"), "in the format GIF");
    assert_eq!(
        found(b"BM\x4e\0\0\0\0\0\0\0\x36\0\0\0"),
        "in the format BMP"
    );
    assert_eq!(found(b"P5\n1 1\n255\n\0"), "in the format PBM");
    assert_eq!(
        found(b"\0\0\0\x18ftypheic\0\0\0\0mif1"),
        "in the format HEIF"
    );
    assert_eq!(
        found(b"{\"img\": \"frame.jpg\"}"),
        "JSON and not the bytes of a file"
    );
    assert_eq!(
        refused(b"no image").to_string(),
        "the image is not in a known image format: send a JPEG, PNG or WebP image"
    );
}

#[test]
fn a_truncated_file_is_an_error_and_never_gray_rows() {
    for name in IMAGES {
        let bytes = fixture(name);
        // The end marker of a JPEG is not a part of its image, nor is the end chunk of a PNG.
        let marker = match name {
            _ if is_baseline(name) => 2,
            _ if bytes.starts_with(b"\x89PNG") => 12,
            _ => 0,
        };
        for length in 0..bytes.len() - marker {
            let error = refused(&bytes[..length]);
            assert!(
                !matches!(error, DecodeError::TooLarge { .. }),
                "{name} cut to {length}: {error}"
            );
        }
    }
}

/// Images whose scan shows their end.
fn is_baseline(name: &str) -> bool {
    name.strip_suffix(".jpg")
        .is_some_and(|stem| stem != "progressive")
}

#[test]
fn a_jpeg_without_its_end_marker_is_whole() {
    for name in IMAGES.into_iter().filter(|name| is_baseline(name)) {
        let mut bytes = fixture(name);
        bytes.truncate(bytes.len() - 2);
        let decode = |bytes: &[u8]| decode(bytes, &DecodeLimits::default()).unwrap();
        assert_eq!(decode(&bytes), decoded(name), "{name}");
        bytes.extend_from_slice(b"dhav\0\x01\xff");
        assert_eq!(decode(&bytes), decoded(name), "{name}");
    }
}

#[test]
fn a_truncated_image_has_a_clear_error() {
    let bytes = fixture("thumbnail.jpg");
    assert_eq!(
        refused(&bytes[..bytes.len() - 40]).to_string(),
        "the JPEG image is damaged or cut off (the file ends early): send the whole file again"
    );
}

#[test]
fn bytes_after_the_end_of_an_image_are_ignored() {
    for name in IMAGES {
        let mut bytes = fixture(name);
        bytes.extend_from_slice(b"\0\0\0\0 trailing \xFF");
        assert!(decode(&bytes, &DecodeLimits::default()).is_ok(), "{name}");
    }
}

#[test]
fn a_webp_frame_larger_than_its_canvas_is_refused() {
    let mut bytes = fixture("alpha_lossy.webp");
    let frame = bytes.windows(4).position(|name| name == b"VP8 ").unwrap();
    bytes[frame + 14..frame + 18].copy_from_slice(&[0xFF, 0x3F, 0xFF, 0x3F]);
    assert!(
        refused(&bytes)
            .to_string()
            .contains("a frame is larger than the image")
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    /// A panic in a decoder would terminate its worker thread.
    #[test]
    fn damaged_images_never_panic(
        image in 0..IMAGES.len(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
        keep in any::<prop::sample::Index>(),
        cut in any::<bool>(),
    ) {
        let mut bytes = fixture(IMAGES[image]);
        for (at, value) in flips {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if cut {
            bytes.truncate(keep.index(bytes.len()));
        }
        let limits = DecodeLimits { max_pixels: 1 << 20, ..DecodeLimits::default() };
        if let Ok(image) = decode(&bytes, &limits) {
            let size = u64::from(image.frame.width()) * u64::from(image.frame.height());
            prop_assert!(size <= limits.max_pixels);
        }
    }

    #[test]
    fn noise_behind_an_image_signature_never_panics(
        signature in prop::sample::select(vec![
            &b"\xFF\xD8\xFF"[..], b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", b"RIFF\x40\0\0\0WEBPVP8 ", b"RIFF\x40\0\0\0WEBPVP8X", b"",
        ]),
        noise in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let bytes = [signature, &noise[..]].concat();
        let _ = decode(&bytes, &DecodeLimits { max_pixels: 1 << 20, ..DecodeLimits::default() });
    }
}

/// The position of the first segment with this marker in a JPEG.
fn segment(bytes: &[u8], marker: u8) -> Option<usize> {
    let mut at = 2;
    while bytes[at + 1] != 0xDA {
        if bytes[at + 1] == marker {
            return Some(at);
        }
        at += 2 + usize::from(u16::from_be_bytes([bytes[at + 2], bytes[at + 3]]));
    }
    None
}

#[test]
fn a_jpeg_without_huffman_tables_has_the_standard_ones() {
    let mut bytes = fixture("orientation_1.jpg");
    while let Some(at) = segment(&bytes, 0xC4) {
        let length = usize::from(u16::from_be_bytes([bytes[at + 2], bytes[at + 3]]));
        bytes.drain(at..at + 2 + length);
    }
    let image = decode(&bytes, &DecodeLimits::default()).unwrap();
    assert_eq!(image, decoded("orientation_1.jpg"));
}

#[test]
fn kinds_of_jpeg_that_are_not_read_are_named() {
    let whole = fixture("orientation_1.jpg");
    let at = segment(&whole, 0xC0).unwrap();
    for (offset, value, expected) in [
        (1, 0xC3, "a lossless JPEG"),
        (1, 0xF7, "a lossless JPEG"),
        (1, 0xC6, "a hierarchical JPEG"),
        (1, 0xC9, "an arithmetic coded JPEG"),
        (4, 12, "a JPEG with 12 bits per sample"),
    ] {
        let mut bytes = whole.clone();
        bytes[at + offset] = value;
        let expected = DecodeError::UnsupportedFormat {
            found: expected.to_owned(),
        };
        assert_eq!(refused(&bytes), expected);
    }
}

#[test]
fn text_instead_of_an_image_is_named() {
    for (text, expected) in [
        (&b"data:image/jpeg;base64,/9j/4AAQ"[..], "base64 text"),
        (b"/9j/4AAQSkZJRg", "base64 text"),
        (b"\n iVBORw0KGgo", "base64 text"),
        (b"{\"image\": \"/9j/\"}", "JSON"),
        (b"\"data:image/png;base64,iVB\"", "base64 text"),
        (b"image=%2F9j%2F4AAQSkZJRg", "base64 text"),
        (b"_9j_4AAQSkZJRg", "base64 text"),
        (b"ffd8ffe000104a46", "hexadecimal text"),
        (b"\x1f\x8b\x08\0", "compressed with gzip"),
        (b"\xff\x4f\xff\x51", "in the format JPEG 2000"),
        (b"\0\0\0\x0cJXL \r\n", "in the format JPEG XL"),
        (b"\0\0\0\x20ftypisom", "a video and not one of its frames"),
        (b"RIFF\0\0\0\0AVI LIST", "a video and not one of its frames"),
        (b"%PDF-1.7", "a PDF document"),
        (b"\xef\xbb\xbf[255, 216]", "JSON"),
        (b"b'\\xff\\xd8\\xff'", "the notation of Python"),
        (b"ff d8 ff e0", "hexadecimal text"),
        (b"=FF=D8=FF", "quoted-printable text"),
        (b"[object File]", "the name of an object"),
        (b"C:\\fakepath\\frame.jpg", "a path or an address"),
        (b"https://camera/snap.jpg", "a path or an address"),
        (b" <!DOCTYPE html>", "a web page or XML"),
        (b"hello", "not in a known image format"),
    ] {
        let refused = refused(text).to_string();
        assert!(refused.contains(expected), "{refused}");
    }
}

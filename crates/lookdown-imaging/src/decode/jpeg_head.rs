//! The segments of a JPEG before its first scan (ITU-T T.81, annex B).

use std::borrow::Cow;

/// The application segment of JPEG files in AVI: its decoders use the tables of annex K.3 where a
/// file has none.
const OF_AVI: [u8; 18] = *b"\xFF\xE0\x00\x10AVI1\0\0\0\0\0\0\0\0\0\0";

/// The facts of the head that decide about decoding.
#[derive(Debug, Default)]
pub(super) struct JpegHead {
    /// The marker of the frame and the bits of a sample.
    frame: Option<(u8, u8)>,
    has_huffman_tables: bool,
}

impl JpegHead {
    /// Reads the head. It ends at the first bytes that are not a segment.
    pub(super) fn new(bytes: &[u8]) -> Self {
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
    pub(super) fn unsupported_kind(&self) -> Option<String> {
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
    pub(super) fn with_huffman_tables<'a>(&self, bytes: &'a [u8]) -> Cow<'a, [u8]> {
        let is_baseline = matches!(self.frame, Some((0xC0 | 0xC1, _)));
        match bytes.split_at_checked(2) {
            Some((start, rest)) if is_baseline && !self.has_huffman_tables => {
                [start, &OF_AVI, rest].concat().into()
            }
            _ => bytes.into(),
        }
    }
}

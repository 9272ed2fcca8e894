//! The validity period of a certificate.

use jiff::{Timestamp, civil::DateTime, tz::TimeZone};

/// The tag of the optional version, the first field of a certificate.
const VERSION: u8 = 0xa0;
/// The tag of a time with a year of two digits.
const UTC_TIME: u8 = 0x17;

/// The validity period of a certificate (RFC 5280, section 4.1.2.5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Validity {
    pub(super) not_before: Timestamp,
    pub(super) not_after: Timestamp,
}

/// An element of DER.
struct Element<'a> {
    tag: u8,
    content: &'a [u8],
}

impl Validity {
    /// Reads the validity of a DER certificate. Returns `None` if it cannot be parsed.
    pub(super) fn from_der(mut certificate: &[u8]) -> Option<Self> {
        let mut fields = next(&mut next(&mut certificate)?.content)?.content;
        if fields.first() == Some(&VERSION) {
            next(&mut fields)?;
        }
        // The serial number, the algorithm and the issuer.
        for _ in 0..3 {
            next(&mut fields)?;
        }
        let mut validity = next(&mut fields)?.content;
        Some(Self {
            not_before: timestamp(&next(&mut validity)?)?,
            not_after: timestamp(&next(&mut validity)?)?,
        })
    }
}

/// Takes the next element off the front of DER.
fn next<'a>(der: &mut &'a [u8]) -> Option<Element<'a>> {
    let [tag, first, rest @ ..] = *der else {
        return None;
    };
    let (length, rest) = match usize::from(*first) {
        short @ ..0x80 => (short, rest),
        long => {
            // The bytes of a length of at most 4 GiB.
            let (bytes, rest) = rest.split_at_checked(long - 0x80)?;
            let bytes = bytes.iter().map(|byte| usize::from(*byte));
            let length = bytes.fold(0_usize, |length, byte| length.saturating_mul(256) | byte);
            (length, rest)
        }
    };
    let (content, rest) = rest.split_at_checked(length)?;
    *der = rest;
    Some(Element { tag: *tag, content })
}

fn timestamp(time: &Element<'_>) -> Option<Timestamp> {
    let text = str::from_utf8(time.content).ok()?;
    let century = match time.tag {
        UTC_TIME if text >= "50" => "19",
        UTC_TIME => "20",
        _ => "",
    };
    let text = format!("{century}{text}");
    let time = DateTime::strptime("%Y%m%d%H%M%SZ", text).ok()?;
    Some(time.to_zoned(TimeZone::UTC).ok()?.timestamp())
}

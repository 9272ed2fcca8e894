//! Revisions: short names for the content of a file.

use std::fmt::Write as _;

use sha2::{Digest, Sha256};

/// Digits of the hash that are shown: enough to tell the versions of one thing apart.
const SHOWN_DIGITS: usize = 12;

/// The SHA-256 of `content`, hexadecimal.
#[must_use]
pub fn sha256_of(content: &[u8]) -> String {
    let digest = Sha256::digest(content);
    digest.iter().fold(String::new(), |mut digits, byte| {
        // Writing to a string cannot fail.
        let _ = write!(digits, "{byte:02x}");
        digits
    })
}

/// The revision of `content`: twelve hexadecimal digits that change whenever the content does.
#[must_use]
pub fn revision_of(content: &[u8]) -> String {
    let mut digits = sha256_of(content);
    digits.truncate(SHOWN_DIGITS);
    digits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_revision_is_the_beginning_of_the_content_s_sha256() {
        // sha256 of nothing, as in FIPS 180-4's test vectors.
        assert_eq!(revision_of(b""), "e3b0c44298fc");
        assert_ne!(revision_of(b"a"), revision_of(b"b"));
    }
}

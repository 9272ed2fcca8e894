//! Revisions: short names for the content of a file.

use std::fmt::Write as _;

use sha2::{Digest, Sha256};

/// Digits of the hash that are shown: enough to distinguish the versions of one file.
const SHOWN_DIGITS: usize = 12;

/// Returns the SHA-256 of `content`, hexadecimal.
pub fn sha256_of(content: &[u8]) -> String {
    let digest = Sha256::digest(content);
    digest.iter().fold(String::new(), |mut digits, byte| {
        // Writing to a string cannot fail.
        let _ = write!(digits, "{byte:02x}");
        digits
    })
}

/// Returns the revision of `content`: twelve hexadecimal digits that change whenever the content
/// does.
pub fn revision_of(content: &[u8]) -> String {
    let mut digits = sha256_of(content);
    digits.truncate(SHOWN_DIGITS);
    digits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_revision_is_the_beginning_of_the_sha256() {
        // The SHA-256 of the empty input, as in the test vectors of FIPS 180-4.
        assert_eq!(revision_of(b""), "e3b0c44298fc");
        assert_ne!(revision_of(b"a"), revision_of(b"b"));
    }
}

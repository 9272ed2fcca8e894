//! API keys, and their digests.
//!
//! A key is 256 random bits and cannot be guessed. A plain SHA-256 therefore keeps it safe in a
//! stolen file, and its check takes a microsecond (docs/adr/0004-api-keys.md).

use std::fmt;

use sha2::{Digest, Sha256};
use subtle::{Choice, ConstantTimeEq};

/// The prefix of keys, by which secret scanners recognize them.
const PREFIX: &str = "lookdown_";
const BYTES: usize = 32;

/// Returns a new random key: `lookdown_` and 64 hexadecimal digits.
///
/// # Errors
/// If the operating system returns no random numbers.
pub fn new_key() -> Result<String, getrandom::Error> {
    let mut bytes = [0; BYTES];
    getrandom::fill(&mut bytes)?;
    Ok(format!("{PREFIX}{}", hex::encode(bytes)))
}

/// The SHA-256 of a key. Its `Debug` output shows nothing of it.
#[derive(Clone)]
pub struct KeyDigest([u8; BYTES]);

impl KeyDigest {
    /// Computes the digest of a key as it was sent.
    pub fn new(key: &[u8]) -> Self {
        Self(Sha256::digest(key).into())
    }

    /// Parses a digest of 64 hexadecimal digits.
    pub fn parse(text: &str) -> Option<Self> {
        let mut bytes = [0; BYTES];
        hex::decode_to_slice(text, &mut bytes).ok()?;
        Some(Self(bytes))
    }

    /// Returns the digest as 64 hexadecimal digits.
    pub fn hexadecimal(&self) -> String {
        hex::encode(self.0)
    }

    /// Compares in constant time.
    pub(super) fn equals(&self, other: &Self) -> Choice {
        self.0.ct_eq(&other.0)
    }
}

impl PartialEq for KeyDigest {
    fn eq(&self, other: &Self) -> bool {
        self.equals(other).into()
    }
}

impl fmt::Debug for KeyDigest {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("KeyDigest(…)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of FIPS 180-4.
    const OF_ABC: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

    #[test]
    fn the_digest_is_sha_256() {
        assert_eq!(KeyDigest::new(b"abc").hexadecimal(), OF_ABC);
        let parsed = KeyDigest::parse(&OF_ABC.to_uppercase()).unwrap();
        assert_eq!(parsed, KeyDigest::new(b"abc"));
    }

    #[test]
    fn only_64_hexadecimal_digits_are_a_digest() {
        for wrong in [
            "",
            "ab",
            &OF_ABC[..62],
            &format!("{OF_ABC}00"),
            &OF_ABC[..63],
        ] {
            assert!(KeyDigest::parse(wrong).is_none(), "{wrong}");
        }
        assert!(KeyDigest::parse(&OF_ABC.replace('b', "g")).is_none());
    }

    #[test]
    fn digests_that_agree_in_all_but_one_byte_differ() {
        let whole = KeyDigest::new(b"abc");
        for at in 0..BYTES {
            let mut other = whole.clone();
            other.0[at] ^= 1;
            assert_ne!(whole, other);
        }
    }

    #[test]
    fn new_keys_are_long_differ_and_are_nowhere_in_debug_output() {
        let (one, other) = (new_key().unwrap(), new_key().unwrap());
        assert_ne!(one, other);
        assert_eq!(one.len(), PREFIX.len() + 64);
        assert_eq!(format!("{:?}", KeyDigest::new(b"abc")), "KeyDigest(…)");
    }
}

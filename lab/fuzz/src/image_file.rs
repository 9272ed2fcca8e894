//! Fuzzes the decoding of images within limits.

use lookdown_imaging::decode::{DecodeLimits, decode};

/// Small limits, to decode thousands of images per second with the same checks.
const LIMITS: DecodeLimits = DecodeLimits {
    max_width: 1024,
    max_height: 1024,
    max_pixels: 256 * 256,
    max_alloc_bytes: 1024 * 1024,
};

/// Decodes `bytes`; returns true if their format is supported.
pub fn read(bytes: &[u8]) -> bool {
    match decode(bytes, &LIMITS) {
        Ok(decoded) => {
            let (width, height) = (decoded.frame.width(), decoded.frame.height());
            assert!(u64::from(width) * u64::from(height) <= LIMITS.max_pixels);
            true
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            !matches!(
                error,
                lookdown_imaging::decode::DecodeError::Empty
                    | lookdown_imaging::decode::DecodeError::UnsupportedFormat { .. }
            )
        }
    }
}

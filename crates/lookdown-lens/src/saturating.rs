//! Numbers without their fraction: those beyond the range of the type become its nearest number,
//! and NaN becomes 0.

#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "`as` saturates"
)]

/// Returns a `u8`.
#[inline]
pub fn to_u8(number: f64) -> u8 {
    number as u8
}

/// Returns a `u32`.
#[inline]
pub fn to_u32(number: f64) -> u32 {
    number as u32
}

/// Returns a `u64`.
#[inline]
pub fn to_u64(number: f64) -> u64 {
    number as u64
}

/// Returns a `usize`.
#[inline]
pub fn to_usize(number: f64) -> usize {
    number as usize
}

//! As many decimals as mean something.

use std::time::Duration;

/// Two decimals: far below what a detector can tell.
pub(in crate::api) fn pixels(value: f64) -> f64 {
    rounded(value, 100.0)
}

/// Four decimals of a share of 1.
pub(super) fn share(value: f64) -> f64 {
    rounded(value, 10_000.0)
}

/// Three decimals: millimetres.
pub(super) fn metres(value: f64) -> f64 {
    rounded(value, 1_000.0)
}

/// Radians in degrees, two decimals.
pub(super) fn degrees(radians: f64) -> f64 {
    rounded(radians.to_degrees(), 100.0)
}

/// Radians in degrees from 0 to below 360, two decimals.
pub(super) fn azimuth_degrees(radians: f64) -> f64 {
    let rounded = degrees(radians);
    if rounded < 360.0 { rounded } else { 0.0 }
}

/// Three decimals: microseconds.
pub(super) fn milliseconds(span: Duration) -> f64 {
    rounded(span.as_secs_f64() * 1_000.0, 1_000.0)
}

fn rounded(value: f64, per_unit: f64) -> f64 {
    // Adding zero turns −0 into 0.
    (value * per_unit).round() / per_unit + 0.0
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "rounded values are exact")]
mod tests {
    use super::*;

    #[test]
    fn values_keep_the_decimals_that_mean_something() {
        assert_eq!(pixels(12.345_678), 12.35);
        assert_eq!(share(0.876_543), 0.8765);
        assert_eq!(metres(-1.234_56), -1.235);
        assert_eq!(degrees(std::f64::consts::FRAC_PI_2), 90.0);
        assert_eq!(milliseconds(Duration::from_nanos(1_234_567)), 1.235);
    }

    #[test]
    fn nothing_is_minus_zero() {
        assert!(pixels(-0.001).is_sign_positive());
    }

    #[test]
    fn an_azimuth_just_below_a_full_turn_is_none() {
        assert_eq!(azimuth_degrees(std::f64::consts::TAU - 1e-9), 0.0);
    }
}

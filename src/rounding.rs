//! Rounding of published numbers to the significant decimals.

use std::time::Duration;

use lookdown_common::report::{ReportFloor, ReportOrientedBox};
use lookdown_lens::geometry::{OrientedBox, floor::FloorPosition};

/// Rounds to two decimals, far below the precision of a detector.
pub(crate) fn pixels(value: f64) -> f64 {
    rounded(value, 100.0)
}

/// Rounds a fraction to four decimals.
pub(crate) fn share(value: f64) -> f64 {
    rounded(value, 10_000.0)
}

/// Rounds to three decimals: millimeters.
pub(crate) fn meters(value: f64) -> f64 {
    rounded(value, 1_000.0)
}

/// Rounds radians down to six decimals, so that a lens that is valid up to an angle is valid there.
pub(crate) fn radians_below(angle: f64) -> f64 {
    (angle * 1e6).floor() / 1e6
}

/// Converts radians to degrees with two decimals.
pub(crate) fn degrees(radians: f64) -> f64 {
    rounded(radians.to_degrees(), 100.0)
}

/// Converts radians to degrees from 0 to below 360, with two decimals.
pub(crate) fn azimuth_degrees(radians: f64) -> f64 {
    let rounded = degrees(radians);
    if rounded < 360.0 { rounded } else { 0.0 }
}

/// Rounds to three decimals: microseconds.
pub(crate) fn milliseconds(span: Duration) -> f64 {
    rounded(span.as_secs_f64() * 1_000.0, 1_000.0)
}

/// Rounds an oriented box.
pub(crate) fn oriented_box(oriented: &OrientedBox) -> ReportOrientedBox {
    ReportOrientedBox {
        cx: pixels(oriented.center.x),
        cy: pixels(oriented.center.y),
        width: pixels(oriented.width),
        height: pixels(oriented.height),
        angle_deg: degrees(oriented.angle),
    }
}

/// Rounds a position on the floor.
pub(crate) fn floor(position: FloorPosition) -> ReportFloor {
    ReportFloor {
        x_m: meters(position.x_m),
        y_m: meters(position.y_m),
    }
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
    fn values_keep_the_significant_decimals() {
        assert_eq!(pixels(12.345_678), 12.35);
        assert_eq!(share(0.876_543), 0.8765);
        assert_eq!(meters(-1.234_56), -1.235);
        assert_eq!(degrees(std::f64::consts::FRAC_PI_2), 90.0);
        assert_eq!(milliseconds(Duration::from_nanos(1_234_567)), 1.235);
    }

    #[test]
    fn minus_zero_becomes_zero() {
        assert!(pixels(-0.001).is_sign_positive());
    }

    #[test]
    fn an_azimuth_rounded_to_a_full_turn_becomes_zero() {
        assert_eq!(azimuth_degrees(std::f64::consts::TAU - 1e-9), 0.0);
    }
}

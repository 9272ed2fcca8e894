//! The plausibility of a box as a person: a factor for its score from its position in its view and
//! from the implied size of the person.

use lookdown_lens::geometry::{Mount, height_ratio::HeightRatio};

/// The factor for a box cut off by the border of its view. Other views show the person whole.
const CUT_OFF_WEIGHT: f64 = 0.7;
/// The share of the score that an impossible height or an impossible width removes.
const IMPOSSIBLE_PENALTY: f64 = 0.7;
/// Heights in camera heights: impossible below the first, fully plausible from the second to the
/// third, impossible from the fourth. Sitting and half hidden people are included.
const HEIGHT: [f64; 4] = [0.1, 0.35, 0.85, 1.05];
/// Widths in camera heights, with the same meaning of the four values.
const WIDTH: [f64; 4] = [0.03, 0.12, 0.7, 1.1];
/// Angles from straight down, radians. Heights have no influence up to the first and full influence
/// from the second.
const HEIGHT_ANGLES: [f64; 2] = [0.15, 0.45];

/// Returns the factor for the score of a box, above 0 and at most 1.
pub(super) fn score_weight(cut_off: bool, height_ratio: Option<HeightRatio>, mount: &Mount) -> f64 {
    let whole = if cut_off { CUT_OFF_WEIGHT } else { 1.0 };
    // Only a camera that faces down is above the heads of all persons.
    match height_ratio {
        Some(height_ratio) if mount.is_near_nadir() => {
            let influence = rise(height_ratio.off_nadir, HEIGHT_ANGLES);
            let height = 1.0 - influence * (1.0 - trapezium(height_ratio.height, HEIGHT));
            let width = trapezium(height_ratio.width, WIDTH);
            whole * penalized(height) * penalized(width)
        }
        _ => whole,
    }
}

fn penalized(plausibility: f64) -> f64 {
    1.0 - IMPOSSIBLE_PENALTY * (1.0 - plausibility)
}

/// Returns 0 up to `from`, 1 from `to` on, and a linear ramp between.
fn rise(value: f64, [from, to]: [f64; 2]) -> f64 {
    ((value - from) / (to - from)).clamp(0.0, 1.0)
}

fn trapezium(value: f64, [from, low, high, to]: [f64; 4]) -> f64 {
    rise(value, [from, low]) * (1.0 - rise(value, [high, to]))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn height_ratio(height: f64, width: f64, off_nadir: f64) -> HeightRatio {
        HeightRatio {
            height,
            width,
            off_nadir,
        }
    }

    #[test]
    fn implausible_sizes_lower_the_score_and_plausible_keep_it() {
        let mount = Mount::default();
        assert_eq!(
            score_weight(false, Some(height_ratio(0.6, 0.2, 1.0)), &mount),
            1.0
        );
        assert!(
            (score_weight(false, Some(height_ratio(0.05, 0.2, 1.0)), &mount) - 0.3).abs() < 1e-12
        );
        assert!(
            (score_weight(false, Some(height_ratio(0.6, 2.0, 1.0)), &mount) - 0.3).abs() < 1e-12
        );
        assert!((score_weight(true, None, &mount) - 0.7).abs() < 1e-12);
    }

    #[test]
    fn height_is_ignored_at_the_nadir_and_for_wall_cameras() {
        assert_eq!(
            score_weight(false, Some(height_ratio(0.0, 0.2, 0.1)), &Mount::default()),
            1.0
        );
        let wall = Mount::new(-Vector3::y_axis(), None);
        assert_eq!(
            score_weight(false, Some(height_ratio(1.0, 0.2, 1.0)), &wall),
            1.0
        );
    }
}

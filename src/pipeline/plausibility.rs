//! How much a box's score is worth, given where it lies in its view and how large a person it
//! would make.

use crate::geometry::{Mount, height_ratio::HeightRatio};

/// What is left of the score of a box cut off by its view's border: its other views know better.
const CUT_OFF_WORTH: f64 = 0.7;
/// How much of a score an impossible height, or an impossible width, takes away.
const IMPOSSIBLE_DOUBT: f64 = 0.7;
/// Heights in camera heights: impossible below the first, fully plausible from the second to the
/// third, impossible from the fourth. Sitting and half hidden people are included.
const HEIGHT: [f64; 4] = [0.1, 0.35, 0.85, 1.05];
/// Widths in camera heights, likewise.
const WIDTH: [f64; 4] = [0.03, 0.12, 0.7, 1.1];
/// Angles from straight down at which heights begin to tell, and tell fully, radians.
const HEIGHTS_TELL: [f64; 2] = [0.15, 0.45];

/// The factor, above 0 and at most 1, for the score of a box.
pub(super) fn score_weight(cut_off: bool, height_ratio: Option<HeightRatio>, mount: &Mount) -> f64 {
    let whole = if cut_off { CUT_OFF_WORTH } else { 1.0 };
    // Only a camera that passes down is above everybody's head.
    match height_ratio {
        Some(height_ratio) if mount.is_near_nadir() => {
            let telling = rise(height_ratio.off_nadir, HEIGHTS_TELL);
            let height = 1.0 - telling * (1.0 - trapezium(height_ratio.height, HEIGHT));
            let width = trapezium(height_ratio.width, WIDTH);
            whole * doubted(height) * doubted(width)
        }
        _ => whole,
    }
}

fn doubted(plausibility: f64) -> f64 {
    1.0 - IMPOSSIBLE_DOUBT * (1.0 - plausibility)
}

/// 0 up to the first, 1 from the second on, straight between.
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
    fn people_keep_their_score_and_the_impossible_loses_most_of_it() {
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
    fn heights_tell_nothing_below_the_camera_or_for_a_camera_on_a_wall() {
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

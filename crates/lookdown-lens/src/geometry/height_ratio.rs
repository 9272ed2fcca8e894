//! The size that a person would have to have: the plausibility of a box as a person on the floor.
//!
//! For a camera that looks down from height `H`, a vertical person whose feet are seen at the angle
//! `foot` from straight down and whose head at `head` stands `H tan(foot)` away and is
//! `H (1 − tan(foot) / tan(head))` tall. The ratio to `H` needs no knowledge of `H`: people are a
//! third to four fifths of it, images on a wall and lamps are not.

use super::{Mount, Ray};

/// Flattest angle from straight down at which the floor distance still means anything, radians.
const FLATTEST: f64 = 1.5;

/// The rays to the ends of an outline: along the vertical and across it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremities {
    /// The upper end, camera frame, any length.
    pub head: Ray,
    /// The lower end.
    pub foot: Ray,
    /// The end to the left of the vertical.
    pub left: Ray,
    /// The end to the right of the vertical.
    pub right: Ray,
}

/// The size of a person standing where an outline's lower end is, in camera heights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeightRatio {
    /// Height over the camera's height; 1 when the head is at the horizon or above.
    pub height: f64,
    /// Width over the camera's height.
    pub width: f64,
    /// Angle of the middle of the outline from straight down, radians.
    pub off_nadir: f64,
}

impl Extremities {
    /// Returns the size ratios of a standing person with this outline; `None` when the outline
    /// reaches across the nadir, where heights cannot be measured.
    pub fn height_ratio(&self, mount: &Mount) -> Option<HeightRatio> {
        let nadir = mount.nadir();
        let horizontal = |ray: &Ray| ray - nadir * ray.dot(&nadir);
        if horizontal(&self.head).dot(&horizontal(&self.foot)) <= 0.0 {
            return None;
        }
        let head = self.head.angle(&nadir);
        let foot = self.foot.angle(&nadir);
        let floor_distance = foot.min(FLATTEST).tan();
        let height = if head < std::f64::consts::FRAC_PI_2 {
            1.0 - floor_distance / head.tan()
        } else {
            1.0
        };
        // Seen from the camera, the middle of the person is this far away.
        let middle_distance = floor_distance.hypot(1.0 - height.clamp(0.0, 1.0) / 2.0);
        Some(HeightRatio {
            height,
            width: self.left.angle(&self.right) * middle_distance,
            off_nadir: f64::midpoint(head, foot),
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn size_of_a_standing_person_is_found_at_any_camera_height(
            distance in 0.5..6.0_f64, azimuth in -3.1..3.1_f64,
            height in 1.0..1.9_f64, width in 0.3..0.8_f64, camera in 2.2..5.0_f64,
        ) {
            let (sin, cos) = f64::sin_cos(azimuth);
            let point = |out: f64, aside: f64, up: f64| {
                Ray::new(out * cos - aside * sin, out * sin + aside * cos, camera - up)
            };
            let extremities = Extremities {
                head: point(distance, 0.0, height),
                foot: point(distance, 0.0, 0.0),
                left: point(distance, -width / 2.0, height / 2.0),
                right: point(distance, width / 2.0, height / 2.0),
            };
            let height_ratio = extremities.height_ratio(&Mount::default()).expect("away from the nadir");
            prop_assert!((height_ratio.height * camera - height).abs() < 1e-9);
            prop_assert!((height_ratio.width * camera - width).abs() < 0.05 * width);
        }
    }

    #[test]
    fn an_outline_across_the_nadir_has_no_height_ratio() {
        let extremities = Extremities {
            head: Ray::new(0.1, 0.0, 1.0),
            foot: Ray::new(-0.1, 0.0, 1.0),
            left: Ray::new(0.0, -0.1, 1.0),
            right: Ray::new(0.0, 0.1, 1.0),
        };
        assert_eq!(extremities.height_ratio(&Mount::default()), None);
    }

    #[test]
    fn what_reaches_the_horizon_is_as_tall_as_the_camera_hangs() {
        let extremities = Extremities {
            head: Ray::new(1.0, 0.0, -0.1),
            foot: Ray::new(1.0, 0.0, 0.4),
            left: Ray::new(1.0, -0.1, 0.2),
            right: Ray::new(1.0, 0.1, 0.2),
        };
        let height_ratio = extremities
            .height_ratio(&Mount::default())
            .expect("away from the nadir");
        assert_eq!(height_ratio.height, 1.0);
    }
}

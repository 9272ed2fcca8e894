//! The height of a person from the two ends of the box along the vertical.
//!
//! With the camera's height `H`, and the foot and the head at the angles `f` and `t` from straight
//! down, the head is `H (1 − tan f / tan t)` above the floor. An error of both angles moves it by
//! `H / (cos² f tan t)` and `H tan f / sin² t` per radian.

use super::{Lens, Mount, OrientedBox, Pixel, Ray, pixels::to_pixel_center};

/// Standard deviation of the angle of either end of a box, with the bias of boxes, which are a
/// little larger than people: 61 boxes of standing people of the rendered development set.
const ANGLE_SD: f64 = 3.3 * std::f64::consts::PI / 180.0;
/// A height with a larger standard deviation means nothing, meters.
const MAX_SD_M: f64 = 0.6;
/// Feet flatter than this are too far away, radians from straight down.
const FLATTEST: f64 = 1.48;

/// The height of a person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonHeight {
    /// Meters above the floor.
    pub height_m: f64,
    /// Its standard deviation, meters.
    pub sd_m: f64,
    /// Angle between the feet and straight down, radians.
    pub foot_angle: f64,
}

impl PersonHeight {
    /// Returns the height of a person who stands on the floor with this box. `None` without the
    /// height of the camera, below the camera, and where the angles say too little.
    pub fn new(person: &OrientedBox, lens: &Lens, mount: &Mount) -> Option<Self> {
        let camera_m = mount.height_m()?;
        let nadir = mount.nadir();
        let ray = |end: Pixel| lens.unproject(&to_pixel_center(end));
        let foot = ray(person.foot())?;
        let head = ray(person.center + person.up * (person.height / 2.0))?;
        let horizontal = |ray: &Ray| ray - nadir * ray.dot(&nadir);
        if horizontal(&foot).dot(&horizontal(&head)) <= 0.0 {
            return None;
        }
        let (foot, head) = (foot.angle(&nadir), head.angle(&nadir));
        if foot > FLATTEST || head <= foot {
            return None;
        }
        let of_foot = 1.0 / (foot.cos().powi(2) * head.tan());
        let of_head = foot.tan() / head.sin().powi(2);
        let sd_m = ANGLE_SD * camera_m * of_foot.hypot(of_head);
        let height_m = camera_m * (1.0 - foot.tan() / head.tan());
        (sd_m <= MAX_SD_M).then_some(Self {
            height_m,
            sd_m,
            foot_angle: foot,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{super::test_people::standing, *};

    #[test]
    fn height_of_a_standing_person_is_found_with_its_error() {
        let lens = Lens::equidistant_circle(299.5, 299.5, 300.0, 1.57).unwrap();
        let up = -nalgebra::Vector3::z_axis();
        let mount = Mount::new(up, Some(3.0));
        for (out_m, height_m) in [(1.5, 1.7), (3.0, 1.2), (4.0, 1.9)] {
            let person = standing(&lens, 3.0, [out_m, 0.0], height_m);
            let found = PersonHeight::new(&person, &lens, &mount).unwrap();
            assert!((found.height_m - height_m).abs() < 1e-6, "{found:?}");
            assert!((0.05..0.6).contains(&found.sd_m), "{found:?}");
        }
        let person = standing(&lens, 3.0, [2.0, 0.0], 1.7);
        assert_eq!(
            PersonHeight::new(&person, &lens, &Mount::new(up, None)),
            None
        );
        let far = standing(&lens, 3.0, [40.0, 0.0], 1.7);
        assert_eq!(PersonHeight::new(&far, &lens, &mount), None);
    }
}

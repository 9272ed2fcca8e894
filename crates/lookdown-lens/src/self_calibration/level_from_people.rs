//! A check of the level of a camera with the people on its floor.
//!
//! People are about equally tall wherever they stand. With a wrong level, they seem to grow on one
//! side of the camera and to shrink on the other. The tilt that removes this is the solution of
//! linear equations: the logarithm of the height of person `i` is
//! `ln h_i = c - a_i x - b_i y`, where `a_i` and `b_i` are its changes with a tilt around both
//! axes, one degree each. Weights after Cauchy keep those who sit, and wrong boxes, from counting.

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

use crate::geometry::{Lens, Mount, OrientedBox, PersonHeight};

/// Fewer people say nothing.
const MIN_PEOPLE: usize = 12;
/// Tilt of the differences, degrees.
const STEP_DEG: f64 = 0.5;
/// Least standard deviation of the logarithm of a height: that of statures.
const LEAST_SCATTER: f64 = 0.06;
/// Rounds of weights.
const ROUNDS: usize = 12;
/// A larger standard deviation says nothing, degrees.
const MAX_SD_DEG: f64 = 4.0;
/// Deviations from which the level of people contradicts the other one.
const CONTRADICTION: f64 = 3.0;

/// The level of a camera by its people.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelFromPeople {
    /// Angle between the vertical of the camera and that of the people, degrees.
    pub difference_deg: f64,
    /// Its standard deviation, degrees.
    pub sd_deg: f64,
}

impl LevelFromPeople {
    /// Returns the level by boxes of people, or `None` if they do not determine it to some degrees.
    /// The height of the mount must be known, and does not matter.
    pub(super) fn new(people: &[OrientedBox], lens: &Lens, mount: &Mount) -> Option<Self> {
        let rows: Vec<(f64, f64, f64)> = people
            .iter()
            .filter_map(|person| row(person, lens, mount))
            .collect();
        if rows.len() < MIN_PEOPLE {
            return None;
        }
        let mut scatter = 4.0 * LEAST_SCATTER;
        let mut solution = Vector3::zeros();
        let mut information = Matrix3::zeros();
        for _ in 0..ROUNDS {
            information = Matrix3::zeros();
            let mut right = Vector3::zeros();
            let (mut squares, mut total) = (0.0, 0.0);
            for (logarithm, along_x, along_y) in &rows {
                let slopes = Vector3::new(1.0, -along_x, -along_y);
                let residual = logarithm - slopes.dot(&solution);
                let ratio = residual / (2.0 * scatter);
                let is_first = solution == Vector3::zeros();
                let weight = if is_first {
                    1.0
                } else {
                    1.0 / (1.0 + ratio * ratio)
                };
                information += weight * slopes * slopes.transpose();
                right += weight * *logarithm * slopes;
                squares += weight * residual * residual;
                total += weight;
            }
            let is_first = solution == Vector3::zeros();
            solution = information.cholesky()?.solve(&right);
            if !is_first {
                scatter = (squares / total).sqrt().max(LEAST_SCATTER);
            }
        }
        let repeated = (rows.len() as f64 / MAX_INDEPENDENT).max(1.0);
        let covariance = information.try_inverse()? * scatter * scatter * repeated;
        let sd_deg = (covariance[(1, 1)] + covariance[(2, 2)]).sqrt();
        (sd_deg <= MAX_SD_DEG).then_some(Self {
            difference_deg: solution[1].hypot(solution[2]),
            sd_deg,
        })
    }

    /// Returns true if the level of the camera, known to `sd_deg`, is not that of the people.
    pub fn contradicts(&self, sd_deg: f64) -> bool {
        self.difference_deg > CONTRADICTION * self.sd_deg.hypot(sd_deg)
    }
}

/// The logarithm of a person's height, and its changes with tilts of one degree around both axes.
fn row(person: &OrientedBox, lens: &Lens, mount: &Mount) -> Option<(f64, f64, f64)> {
    let at = |axis: &Unit<Vector3<f64>>, degrees: f64| {
        let turn = Rotation3::from_axis_angle(axis, degrees.to_radians());
        let up = Unit::new_normalize(turn * mount.world_up());
        let height = PersonHeight::new(person, lens, &Mount::new(up, mount.height_m()))?;
        (height.height_m > 0.0).then(|| height.height_m.ln())
    };
    let along = |axis: Unit<Vector3<f64>>| {
        Some((at(&axis, STEP_DEG)? - at(&axis, -STEP_DEG)?) / (2.0 * STEP_DEG))
    };
    PersonHeight::new(person, lens, mount).filter(has_visible_feet)?;
    Some((
        at(&Vector3::x_axis(), 0.0)?,
        along(Vector3::x_axis())?,
        along(Vector3::y_axis())?,
    ))
}

/// Reports repeat the same people: more boxes are no more evidence than these.
pub(super) const MAX_INDEPENDENT: f64 = 30.0;
/// Least angle between the feet of a person and straight down, radians. Nearer people hide their
/// feet, so that they seem taller than they are: by 7 % at 30° to 45°, and by 18 % below.
const LEAST_FOOT_ANGLE: f64 = 0.698;

/// Returns true for people far enough away to show their feet.
pub(super) fn has_visible_feet(person: &PersonHeight) -> bool {
    person.foot_angle >= LEAST_FOOT_ANGLE
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::test_people::standing;

    fn lens() -> Lens {
        Lens::equidistant_circle(799.5, 799.5, 800.0, 1.57).unwrap()
    }

    /// The mount of a camera 3 m above the floor, whose level is wrong by degrees around an axis.
    fn mount(degrees: f64, azimuth: f64) -> Mount {
        let axis = Unit::new_normalize(Vector3::new(azimuth.cos(), azimuth.sin(), 0.0));
        let turn = Rotation3::from_axis_angle(&axis, degrees.to_radians());
        Mount::new(Unit::new_normalize(turn * -Vector3::z()), Some(3.0))
    }

    proptest! {
        #[test]
        fn wrong_level_is_seen_in_the_heights_of_people(
            people in prop::collection::vec((2.8..5.0_f64, -3.1..3.1_f64, 1.60..1.85_f64), 40..60),
            seated in prop::collection::vec((2.8..4.0_f64, -3.1..3.1_f64, 1.1..1.4_f64), 0..6),
            azimuth in -3.1..3.1_f64,
            degrees in prop::sample::select(vec![0.0, 4.0, 8.0]),
        ) {
            let boxes: Vec<_> = people.iter().chain(&seated)
                .map(|(out_m, azimuth, height_m)| standing(&lens(), 3.0, [*out_m, *azimuth], *height_m))
                .collect();
            let level = LevelFromPeople::new(&boxes, &lens(), &mount(degrees, azimuth)).unwrap();
            let off = (level.difference_deg - degrees).abs();
            prop_assert!(off < 3.5 * level.sd_deg + 0.15 * degrees, "{level:?}, true {degrees}");
            prop_assert!(degrees < 8.0 || level.contradicts(0.2), "{level:?}");
        }
    }

    #[test]
    fn few_people_say_nothing_about_the_level() {
        let boxes: Vec<_> = (0..11)
            .map(|index| standing(&lens(), 3.0, [3.0, f64::from(index)], 1.7))
            .collect();
        assert_eq!(
            LevelFromPeople::new(&boxes, &lens(), &mount(0.0, 0.0)),
            None
        );
    }
}

//! The height of a camera from the people on its floor.
//!
//! A box of a person gives the ratio of the height of its upper end to that of the camera
//! ([`PersonHeight`]). Most people stand and are 1.70 m tall, others sit, and some boxes are wrong.
//! So the height of the camera is the mean of its posterior distribution, with a mixture of these
//! three as the likelihood of a ratio.

use std::f64::consts::TAU;

use nalgebra::Unit;

use super::level_from_people::{LevelFromPeople, MAX_INDEPENDENT, has_visible_feet};
use crate::geometry::{Lens, Mount, OrientedBox, PersonHeight};

/// A kind of person, by the upper end of the box.
struct Kind {
    /// Share of the people.
    share: f64,
    /// Mean height of the upper end of the box, meters.
    mean_m: f64,
    /// Its standard deviation, meters.
    sd_m: f64,
}

/// People who stand are 1.70 m tall, and a box ends some centimeters above them. The feet of people
/// who sit are in front of them, so that they seem taller than they are.
const KINDS: [Kind; 2] = [
    Kind {
        share: 0.70,
        mean_m: 1.75,
        sd_m: 0.10,
    },
    Kind {
        share: 0.25,
        mean_m: 1.35,
        sd_m: 0.20,
    },
];
/// Share of other boxes, whose height is anything in [`OTHERS_M`].
const OTHERS: f64 = 0.05;
const OTHERS_M: (f64, f64) = (0.3, 2.3);
/// Heights of cameras, meters: the median and the deviation of the logarithm.
const PRIOR: (f64, f64) = (2.9, 0.25);
/// The heights that are tried, meters.
const HEIGHTS_M: (f64, f64) = (1.8, 12.0);
const STEPS: u32 = 400;
/// Deviation of the mean stature of the people of one place from that of all, and of the boxes of
/// one camera, as a share.
const STATURE_BIAS: f64 = 0.03;
/// With fewer people who show their feet, the nearer ones count as well.
const ENOUGH_PEOPLE: usize = 8;
/// Deviation of the height then, as a share.
const NEAR_BIAS: f64 = 0.08;
/// Fewer people do not determine the height.
const MIN_PEOPLE: usize = 3;
/// A larger deviation is refused, as a share of the height.
const MAX_SD: f64 = 0.12;
/// The assumed height of the camera, meters. Ratios do not depend on it.
const NOMINAL_M: f64 = 3.0;

/// The height of a camera above the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraHeight {
    /// Meters.
    pub height_m: f64,
    /// Its standard deviation, meters.
    pub sd_m: f64,
    /// The number of people whose height could be measured.
    pub people: usize,
    /// The level by the same people, if they determine it.
    pub level: Option<LevelFromPeople>,
}

/// The people do not determine the height.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum HeightRefusal {
    /// Too few people, or people below the camera only.
    #[error(
        "{people} people have a measurable height, {MIN_PEOPLE} are needed: give more frames with people who stand some \
         meters away from the camera"
    )]
    TooFewPeople {
        /// Number of people.
        people: usize,
    },
    /// Heights that contradict each other.
    #[error(
        "the people determine the height of the camera to {sd_percent:.0} % only: give more frames with people who stand"
    )]
    Uncertain {
        /// Standard deviation, percent.
        sd_percent: f64,
    },
}

impl HeightRefusal {
    /// Returns the name of the reason, for programs: the variant in snake case.
    pub fn reason(&self) -> &'static str {
        self.into()
    }
}

impl CameraHeight {
    /// Returns the height of a camera from boxes of people on its floor. The height of the mount is
    /// not used.
    ///
    /// # Errors
    /// [`HeightRefusal`].
    pub fn from_people(
        people: &[OrientedBox],
        lens: &Lens,
        mount: &Mount,
    ) -> Result<Self, HeightRefusal> {
        let mount = Mount::new(Unit::new_normalize(mount.world_up()), Some(NOMINAL_M));
        let heights = people
            .iter()
            .filter_map(|person| PersonHeight::new(person, lens, &mount));
        let (mut heights, near): (Vec<_>, Vec<_>) = heights.partition(has_visible_feet);
        let mut bias = STATURE_BIAS;
        if heights.len() < ENOUGH_PEOPLE && !near.is_empty() {
            heights.extend(near);
            bias = NEAR_BIAS;
        }
        let people_count = heights.len();
        if people_count < MIN_PEOPLE {
            return Err(HeightRefusal::TooFewPeople {
                people: people_count,
            });
        }
        let ratios: Vec<_> = heights
            .iter()
            .map(|height| (height.height_m / NOMINAL_M, height.sd_m / NOMINAL_M))
            .collect();
        let (height_m, sd_m) = posterior(&ratios);
        let sd_m = sd_m.hypot(bias * height_m);
        if sd_m > MAX_SD * height_m {
            let sd_percent = 100.0 * sd_m / height_m;
            return Err(HeightRefusal::Uncertain { sd_percent });
        }
        Ok(Self {
            height_m,
            sd_m,
            people: people_count,
            level: LevelFromPeople::new(people, lens, &mount),
        })
    }
}

/// Returns the mean and the standard deviation of the height, meters.
fn posterior(ratios: &[(f64, f64)]) -> (f64, f64) {
    let (least, most) = (HEIGHTS_M.0.ln(), HEIGHTS_M.1.ln());
    let weight = (MAX_INDEPENDENT / ratios.len() as f64).min(1.0);
    let points: Vec<(f64, f64)> = (0..=STEPS)
        .map(|step| {
            let height = (least + (most - least) * f64::from(step) / f64::from(STEPS)).exp();
            let seen: f64 = ratios
                .iter()
                .map(|ratio| likelihood(*ratio, height).ln())
                .sum();
            let expected = (height / PRIOR.0).ln() / PRIOR.1;
            (height, weight * seen - expected * expected / 2.0)
        })
        .collect();
    let best = points
        .iter()
        .map(|(_, log)| *log)
        .fold(f64::NEG_INFINITY, f64::max);
    let weighted = |value: &dyn Fn(f64) -> f64| -> f64 {
        points
            .iter()
            .map(|(height, log)| value(*height) * (log - best).exp())
            .sum()
    };
    let all = weighted(&|_| 1.0);
    let mean = weighted(&|height| height) / all;
    let variance = weighted(&|height| (height - mean).powi(2)) / all;
    (mean, variance.sqrt())
}

/// Returns the density of a ratio with its standard deviation, for a camera at this height, meters.
fn likelihood((ratio, sd): (f64, f64), height: f64) -> f64 {
    let kinds = KINDS.iter().map(|kind| {
        let variance = (kind.sd_m / height).powi(2) + sd * sd;
        let off = ratio - kind.mean_m / height;
        kind.share * (-off * off / (2.0 * variance)).exp() / (TAU * variance).sqrt()
    });
    let (least, most) = OTHERS_M;
    let is_within = (least..most).contains(&(ratio * height));
    let others = if is_within {
        OTHERS * height / (most - least)
    } else {
        0.0
    };
    // No single box excludes a height.
    kinds.sum::<f64>() + others + 1e-6
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::test_people::standing;

    fn lens() -> Lens {
        Lens::equidistant_circle(799.5, 799.5, 800.0, 1.57).unwrap()
    }

    fn mount() -> Mount {
        Mount::new(-nalgebra::Vector3::z_axis(), None)
    }

    proptest! {
        #[test]
        fn height_is_found_among_seated_people_and_errors(
            camera_m in 2.3..4.5_f64,
            people in prop::collection::vec((1.0..2.0_f64, -3.1..3.1_f64, 1.60..1.90_f64), 24..40),
            seated in prop::collection::vec((1.0..1.6_f64, -3.1..3.1_f64, 1.1..1.4_f64), 0..8),
            wrong in prop::collection::vec((1.0..1.6_f64, -3.1..3.1_f64, 0.4..0.8_f64), 0..3),
        ) {
            let boxes: Vec<_> = people.iter().chain(&seated).chain(&wrong)
                .map(|(out, azimuth, height_m)| standing(&lens(), camera_m, [out * camera_m, *azimuth], *height_m))
                .collect();
            let found = CameraHeight::from_people(&boxes, &lens(), &mount()).unwrap();
            let error = found.height_m / camera_m - 1.0;
            prop_assert!(error.abs() < 0.08, "{found:?} for {camera_m}");
            prop_assert!((found.height_m - camera_m).abs() < 3.0 * found.sd_m, "{found:?} for {camera_m}");
        }
    }

    #[test]
    fn too_few_people_are_refused() {
        let boxes = [[2.7, 0.3], [3.0, 2.0]].map(|place| standing(&lens(), 3.0, place, 1.7));
        let refusal = CameraHeight::from_people(&boxes, &lens(), &mount()).unwrap_err();
        assert_eq!(refusal, HeightRefusal::TooFewPeople { people: 2 });
    }

    #[test]
    fn heights_that_fit_several_cameras_are_refused() {
        // Three people who sit below a usual camera, or who stand below a high one.
        let boxes = [0.0, 1.0, 2.0].map(|azimuth| standing(&lens(), 3.0, [2.7, azimuth], 0.9));
        let refusal = CameraHeight::from_people(&boxes, &lens(), &mount()).unwrap_err();
        assert!(
            matches!(refusal, HeightRefusal::Uncertain { .. }),
            "{refusal}"
        );
    }
}

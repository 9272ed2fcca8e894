//! Walks over the floor of two cameras, with the noise of places.

use proptest::prelude::*;

use super::{NoPose, Walk, relative_pose};
use crate::CameraPose;

/// A linear congruential generator (Knuth, MMIX): the same walks on all machines.
struct Chance(u64);

impl Chance {
    /// Uniform from -1 to 1.
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let share = (self.0 >> 33) as f64 / f64::from(1_u32 << 30);
        share - 1.0
    }
}

/// People who walk straight over the floor from one point to another, one every 4 s.
fn walks(people: u32, chance: &mut Chance) -> Vec<Walk> {
    let walk = |person: u32| {
        let begin = f64::from(person) * 4.0;
        let mut point = || [6.0 * chance.next(), 6.0 * chance.next()];
        let (from, to) = (point(), point());
        let at = |step: u32| {
            let share = f64::from(step) / 40.0;
            let place = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
            (begin + 0.2 * f64::from(step), place)
        };
        (0..=40).map(at).collect()
    };
    (0..people).map(walk).collect()
}

/// The walks as a camera at `pose` sees them, with errors of up to `error_m` at each place.
fn seen(walks: &[Walk], pose: &CameraPose, error_m: f64, chance: &mut Chance) -> Vec<Walk> {
    let see = |walk: &Walk| {
        let point = |&(at_s, place): &(f64, [f64; 2])| {
            let place = pose.from_site(place);
            (at_s, place.map(|value| value + error_m * chance.next()))
        };
        walk.iter().map(point).collect()
    };
    walks.iter().map(see).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn the_pose_is_found_within_four_deviations(
        seed in 1_u64..u64::MAX,
        x in -8.0..8.0_f64,
        y in -8.0..8.0_f64,
        yaw_deg in -179.0..179.0_f64,
    ) {
        let chance = &mut Chance(seed);
        let walks = walks(20, chance);
        let pose = CameraPose { position_m: [x, y], yaw_deg, height_m: Some(3.0) };
        let first = seen(&walks, &CameraPose::alone(Some(3.0)), 0.2, chance);
        let second = seen(&walks, &pose, 0.2, chance);
        let found = relative_pose(&first, &second);
        // One of 500 sets of walks fits two places alike, and is refused.
        prop_assume!(found != Err(NoPose::Ambiguous));
        let found = found.unwrap();
        let error = (found.position_m[0] - x).hypot(found.position_m[1] - y);
        prop_assert!(error < 0.02 + 4.0 * found.position_sd_m, "{error} {found:?}");
        let turn = (found.yaw_deg - yaw_deg).to_radians().sin().asin().to_degrees();
        prop_assert!(turn.abs() < 0.1 + 4.0 * found.yaw_sd_deg, "{turn} {found:?}");
        prop_assert!(found.residual_m < 0.3 && found.walks >= 10, "{found:?}");
    }
}

#[test]
fn exchanged_cameras_give_the_inverse_pose() {
    let chance = &mut Chance(11);
    let walks = walks(20, chance);
    let pose = CameraPose {
        position_m: [5.0, 2.0],
        yaw_deg: 70.0,
        height_m: Some(3.0),
    };
    let first = seen(&walks, &CameraPose::alone(Some(3.0)), 0.2, chance);
    let second = seen(&walks, &pose, 0.2, chance);
    let there = relative_pose(&first, &second).unwrap();
    let back = relative_pose(&second, &first).unwrap();
    let found = CameraPose {
        position_m: there.position_m,
        yaw_deg: there.yaw_deg,
        height_m: None,
    };
    let [x, y] = found.to_site(back.position_m);
    assert!(x.hypot(y) < 1e-6, "{x} {y}");
    assert!((there.yaw_deg + back.yaw_deg).abs() < 1e-6);
    assert!((there.scale * back.scale - 1.0).abs() < 1e-9);
}

#[test]
fn lasting_errors_of_a_crowd_are_in_the_deviations() {
    let chance = &mut Chance(13);
    let walks = walks(20, chance);
    let pose = CameraPose {
        position_m: [5.0, 2.0],
        yaw_deg: 70.0,
        height_m: Some(3.0),
    };
    let first = seen(&walks, &CameraPose::alone(Some(3.0)), 0.2, chance);
    let mut second = seen(&walks, &pose, 0.2, chance);
    for walk in &mut second {
        // Hidden legs: the place is farther away by a share of the distance.
        let share = 1.0 + 0.15 * chance.next().abs();
        for (_, place) in walk {
            *place = place.map(|value| share * value);
        }
    }
    let found = relative_pose(&first, &second).unwrap();
    let error = (found.position_m[0] - 5.0).hypot(found.position_m[1] - 2.0);
    assert!(error < 2.0 * found.position_sd_m, "{error} {found:?}");
    assert!(
        (found.yaw_deg - 70.0).abs() < 2.0 * found.yaw_sd_deg,
        "{found:?}"
    );
}

#[test]
fn walks_of_other_people_tell_no_pose() {
    let chance = &mut Chance(7);
    let (first, second) = (walks(20, chance), walks(20, chance));
    let refused = relative_pose(&first, &second).unwrap_err();
    assert!(
        matches!(refused, NoPose::TooFew(_) | NoPose::Ambiguous),
        "{refused}"
    );
}

#[test]
fn three_walks_are_too_few() {
    let chance = &mut Chance(3);
    let walks = walks(3, chance);
    assert_eq!(relative_pose(&walks, &walks), Err(NoPose::TooFew(3)));
    assert_eq!(relative_pose(&[], &[]), Err(NoPose::TooFew(0)));
}

#[test]
fn a_wrong_height_is_told_by_the_scale() {
    let chance = &mut Chance(5);
    let walks = walks(20, chance);
    let scaled = |walk: &Walk| {
        let point = |&(at_s, place): &(f64, [f64; 2])| (at_s, place.map(|value| 0.84 * value));
        walk.iter().map(point).collect()
    };
    let second: Vec<Walk> = walks.iter().map(scaled).collect();
    assert!(matches!(relative_pose(&walks, &second), Err(NoPose::Scale(scale)) if scale > 1.15));
}

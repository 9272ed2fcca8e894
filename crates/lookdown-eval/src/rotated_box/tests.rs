//! Tests of the mask of a rotated box. Known answers are in `tests/known_answers/evaluation.rs`.

use std::f64::consts::{FRAC_PI_2, PI};

use proptest::prelude::*;

use super::*;

const FRAME: [u32; 2] = [100, 80];

fn rotated(numbers: [f64; 4], angle: f64) -> RotatedBox {
    RotatedBox::new(numbers, angle, FRAME).unwrap()
}

#[test]
fn an_upright_box_of_whole_pixels_covers_exactly_these() {
    let upright = rotated([20.0, 30.0, 10.0, 20.0], 0.0);
    assert_eq!(upright.area(), 200.0);
    let shifted = rotated([25.0, 30.0, 10.0, 20.0], 0.0);
    assert_eq!(upright.intersection_area(&shifted), 100.0);
    assert_eq!(upright.iou(&shifted), 100.0 / 300.0);
    assert_eq!(upright.share_in(&shifted), 0.5);
}

#[test]
fn the_angle_turns_clockwise_from_image_up() {
    // The upper end leans to the upper right.
    let leaning = rotated([50.0, 40.0, 6.0, 40.0], PI / 4.0);
    let at = |x, y| rotated([x, y, 4.0, 4.0], 0.0);
    assert_eq!(at(60.0, 30.0).share_in(&leaning), 1.0);
    assert_eq!(at(60.0, 50.0).share_in(&leaning), 0.0);
}

#[test]
fn quarter_turns_swap_the_extents_and_half_turns_do_not() {
    let upright = rotated([50.2, 40.3, 10.0, 24.0], 0.0);
    assert_eq!(upright.iou(&rotated([50.2, 40.3, 10.0, 24.0], PI)), 1.0);
    let lying = rotated([50.2, 40.3, 24.0, 10.0], FRAC_PI_2);
    assert_eq!(upright.iou(&lying), 1.0);
}

#[test]
fn parts_outside_the_frame_do_not_count() {
    let half_outside = rotated([0.0, 40.0, 20.0, 10.0], 0.0);
    assert_eq!(half_outside.area(), 100.0);
    let outside = rotated([-30.0, 40.0, 20.0, 10.0], 0.3);
    assert_eq!(outside.area(), 0.0);
    assert_eq!(outside.iou(&outside), 0.0);
    assert_eq!(outside.share_in(&half_outside), 0.0);
}

#[test]
fn the_ellipse_in_an_upright_box_touches_its_edges() {
    let bounds = rotated([20.0, 30.0, 10.0, 20.0], 0.0).inscribed_ellipse_bounds();
    assert_eq!(bounds.unwrap().corners(), [15.0, 20.0, 25.0, 40.0]);
}

#[test]
fn invalid_numbers_are_refused() {
    for numbers in [
        [f64::NAN, 0.0, 1.0, 1.0],
        [0.0, f64::INFINITY, 1.0, 1.0],
        [0.0, 0.0, -1.0, 1.0],
        [0.0, 0.0, 1.0, 1e10],
    ] {
        assert_eq!(RotatedBox::new(numbers, 0.0, FRAME), None, "{numbers:?}");
    }
    assert_eq!(RotatedBox::new([0.0; 4], f64::NAN, FRAME), None);
    assert_eq!(RotatedBox::new([0.0; 4], 0.0, [u32::MAX, 80]), None);
}

proptest! {
    #[test]
    fn overlaps_are_symmetric_and_between_0_and_1(
        a in prop::array::uniform4(0.0..120.0),
        b in prop::array::uniform4(0.0..120.0),
        angles in prop::array::uniform2(-7.0..7.0),
    ) {
        let (a, b) = (rotated(a, angles[0]), rotated(b, angles[1]));
        prop_assert!((0.0..=1.0).contains(&a.iou(&b)));
        prop_assert!((0.0..=1.0).contains(&a.share_in(&b)));
        prop_assert_eq!(a.iou(&b), b.iou(&a));
        prop_assert!(a.intersection_area(&b) <= a.area().min(b.area()));
    }
}

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use proptest::prelude::*;

use super::*;

#[test]
fn the_height_axis_of_a_ceiling_camera_points_outward() {
    let lens = Lens::equidistant_circle(299.5, 299.5, 300.0, FRAC_PI_2).expect("plausible");
    let up = vertical_in_frame(Pixel::new(500.0, 300.0), &lens, &Mount::default());
    assert!((up - Vector2::new(1.0, 0.0)).norm() < 1e-6);
    // At the nadir every direction is outward; image up stands in.
    let up = vertical_in_frame(Pixel::new(300.0, 300.0), &lens, &Mount::default());
    assert!((up - Vector2::new(0.0, -1.0)).norm() < 1e-6);
}

#[test]
fn angles_run_clockwise_from_up_and_ignore_the_axis_sign() {
    for (up, angle) in [
        ((0.0, -1.0), 0.0),
        ((1.0, 0.0), FRAC_PI_2),
        ((1.0, -1.0), FRAC_PI_4),
        ((-1.0, -1.0), -FRAC_PI_4),
        ((-1.0, 0.0), FRAC_PI_2),
        ((0.0, 1.0), 0.0),
        ((1.0, 1.0), -FRAC_PI_4),
    ] {
        let found = axis_angle(Vector2::new(up.0, up.1).normalize());
        assert!((found - angle).abs() < 1e-12, "{up:?}: {found}");
    }
}

#[test]
fn the_average_of_two_outlines_lies_between_them() {
    let square = |x: f64, size: f64| {
        vec![
            Pixel::new(x, 0.0),
            Pixel::new(x + size, 0.0),
            Pixel::new(x + size, size),
            Pixel::new(x, size),
        ]
    };
    let (small, large) = (square(0.0, 10.0), square(10.0, 20.0));
    let up = Vector2::new(0.0, -1.0);
    let average =
        OrientedBox::averaging(up, [(1.0, &small[..]), (3.0, &large[..])]).expect("outlines");
    assert!((average.width - 17.5).abs() < 1e-12);
    assert!((average.height - 17.5).abs() < 1e-12);
    assert!((average.center.x - 16.25).abs() < 1e-12);
    assert!((average.foot().y - 17.5).abs() < 1e-12);
    assert_eq!(OrientedBox::averaging(up, []), None);
}

/// The bounds of the ellipse inscribed in an oriented box.
fn inscribed_bounds(oriented: &OrientedBox) -> [f64; 4] {
    let (along, across) = (oriented.height / 2.0, oriented.width / 2.0);
    let half = |on_axis: f64, off_axis: f64| (along * on_axis).hypot(across * off_axis);
    let (x, y) = (
        half(oriented.up.x, oriented.up.y),
        half(oriented.up.y, oriented.up.x),
    );
    let center = oriented.center;
    [center.x - x, center.y - y, center.x + x, center.y + y]
}

proptest! {
    #[test]
    fn widths_in_two_pairs_of_directions_tell_the_axis_of_a_body(
        height in 100.0..200.0_f64,
        thinness in 0.2..0.6_f64,
        angle in -1.5..1.5_f64,
        turned_by in 0.35..1.2_f64,
    ) {
        let center = Pixel::new(300.0, 200.0);
        let body = OrientedBox::turned(center, thinness * height, height, angle);
        let mut widths = Vec::new();
        for direction in [0.0, FRAC_PI_2, turned_by, turned_by + FRAC_PI_2] {
            let normal = Vector2::new(direction.sin(), -direction.cos());
            widths.push((0.5, normal * body.along(&normal).height));
        }
        let upright = body.along(&Vector2::new(0.0, -1.0));
        // A box without extents says nothing.
        widths.extend([Vector2::zeros(), Vector2::new(1e-180, 0.0)].map(|width| (0.5, width)));
        let found = upright.tilted_to_widths(&widths);
        prop_assert_eq!(found.center, center);
        prop_assert!(found.up.dot(&body.up).abs() > 0.99, "{found:?}");
        prop_assert!((found.height / body.height - 1.0).abs() < 0.03, "{found:?}");
        // The box along the vertical is the same again.
        let back = found.along(&upright.up);
        prop_assert!((back.height - upright.height).abs() < 1e-9, "{back:?}");
        prop_assert!((back.width - upright.width).abs() < 1e-9, "{back:?}");
    }

    #[test]
    fn the_box_along_another_axis_has_the_extents_of_the_ellipse(
        width in 5.0..80.0_f64,
        height in 5.0..80.0_f64,
        angle in -1.5..1.5_f64,
    ) {
        let oriented = OrientedBox::turned(Pixel::new(300.0, 200.0), width, height, angle);
        let along = oriented.along(&Vector2::new(0.0, -3.0));
        let [x_min, y_min, x_max, y_max] = inscribed_bounds(&oriented);
        prop_assert!((along.width - (x_max - x_min)).abs() < 1e-9);
        prop_assert!((along.height - (y_max - y_min)).abs() < 1e-9);
        prop_assert!((along.along(&along.up).height - along.height).abs() < 1e-9);
    }

    #[test]
    fn a_box_fitted_to_its_own_bounds_stays_as_it_is(
        angle in -1.5..1.5_f64, width in 5.0..100.0_f64, height in 5.0..200.0_f64,
    ) {
        let oriented = OrientedBox::turned(Pixel::new(300.0, 200.0), width, height, angle);
        let fitted = oriented.fitted_to(inscribed_bounds(&oriented));
        prop_assert!((fitted.width - width).abs() < 1e-6, "{fitted:?}");
        prop_assert!((fitted.height - height).abs() < 1e-6, "{fitted:?}");
        prop_assert!((fitted.center - oriented.center).norm() < 1e-9);
    }

    #[test]
    fn a_fitted_box_has_the_diagonal_of_the_bounds(
        angle in -1.5..1.5_f64,
        [width, height, right, down] in prop::array::uniform4(5.0..100.0_f64),
    ) {
        let oriented = OrientedBox::turned(Pixel::new(0.0, 0.0), width, height, angle);
        let fitted = oriented.fitted_to([0.0, 0.0, right, down]);
        let [x_min, y_min, x_max, y_max] = inscribed_bounds(&fitted);
        let diagonal = (x_max - x_min).hypot(y_max - y_min);
        prop_assert!((diagonal - right.hypot(down)).abs() < 1e-6, "{fitted:?}");
        prop_assert!(fitted.width >= 0.0 && fitted.height >= 0.0);
    }

    #[test]
    fn an_upright_fitted_box_is_the_bounds(
        turns in 0..4_i32, [right, down] in prop::array::uniform2(5.0..100.0_f64),
    ) {
        let angle = FRAC_PI_2 * f64::from(turns);
        let oriented = OrientedBox::turned(Pixel::new(0.0, 0.0), 10.0, 20.0, angle);
        let found = inscribed_bounds(&oriented.fitted_to([0.0, 0.0, right, down]));
        for (side, expected) in found.into_iter().zip([0.0, 0.0, right, down]) {
            prop_assert!((side - expected).abs() < 1e-6, "{found:?}");
        }
    }
}

#[test]
fn head_is_at_the_upper_end_in_frames_of_all_sizes() {
    let person = OrientedBox::turned(Pixel::new(100.0, 60.0), 20.0, 40.0, 0.0);
    assert_eq!(person.foot(), Pixel::new(100.0, 80.0));
    let turned = person.with_head_toward(&Vector2::new(0.3, 0.9)).scaled(2.0);
    assert_eq!(turned.foot(), Pixel::new(200.0, 80.0));
    assert_eq!(turned.corners(), person.scaled(2.0).corners());
}

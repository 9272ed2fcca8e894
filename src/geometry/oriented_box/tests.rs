use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

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

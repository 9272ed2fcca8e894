use nalgebra::{Unit, Vector3};
use proptest::prelude::*;

use super::*;
use crate::geometry::Ray;

fn lens() -> Lens {
    Lens::equidistant_circle(299.5, 299.5, 300.0, std::f64::consts::FRAC_PI_2).expect("plausible")
}

#[test]
fn bearings_start_at_image_right_and_grow_clockwise() {
    let right = bearing(Pixel::new(450.0, 300.0), &lens()).expect("inside");
    assert!(
        right.azimuth.abs() < 1e-9 && (right.off_axis - std::f64::consts::FRAC_PI_4).abs() < 1e-9
    );
    let down = bearing(Pixel::new(300.0, 450.0), &lens()).expect("inside");
    assert!((down.azimuth.to_degrees() - 90.0).abs() < 1e-9);
    assert_eq!(bearing(Pixel::new(0.0, 0.0), &lens()), None);
}

proptest! {
    #[test]
    fn a_floor_point_is_found_again_through_a_tilted_camera(
        x_m in -4.0..4.0, y_m in -4.0..4.0, height_m in 2.0..5.0,
        tilt_x in -0.3..0.3, tilt_y in -0.3..0.3,
    ) {
        let mount = Mount::new(Unit::new_normalize(Vector3::new(tilt_x, tilt_y, -1.0)), Some(height_m));
        let ray = mount.camera_from_floor() * Ray::new(x_m, y_m, height_m);
        if let Some(pixel) = lens().project(&ray) {
            let corner = to_corner_origin(pixel);
            let found = floor_position(corner, &lens(), &mount).expect("below the camera");
            prop_assert!((found.x_m - x_m).abs() < 1e-6 && (found.y_m - y_m).abs() < 1e-6);
        }
    }
}

#[test]
fn no_floor_without_a_height_or_above_the_horizon() {
    let point = Pixel::new(450.0, 300.0);
    assert_eq!(floor_position(point, &lens(), &Mount::default()), None);
    let looking_up = Mount::new(Vector3::z_axis(), Some(1.0));
    assert_eq!(floor_position(point, &lens(), &looking_up), None);
}

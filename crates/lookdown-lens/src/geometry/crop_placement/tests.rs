use proptest::prelude::*;

use super::*;
use crate::geometry::{Ray, pixels::to_pixel_center};

const SIDE: u32 = 416;
const FILL: f64 = 0.3;

fn targets() -> impl Strategy<Value = Vec<CropTarget>> {
    let target = (
        0.0..2000.0_f64,
        0.0..2000.0_f64,
        0.0..300.0_f64,
        0.0..300.0_f64,
        0.01..1.0_f64,
        0.0..7.0_f64,
    )
        .prop_map(|(x, y, width, height, score, angle)| CropTarget {
            bbox: [x, y, x + width, y + height],
            score,
            up: Vector2::new(angle.sin(), angle.cos()),
        });
    prop::collection::vec(target, 0..60)
}

proptest! {
    #[test]
    fn the_most_crops_are_never_exceeded(targets in targets(), most in 0..20_usize) {
        let crops = place_crops(&targets, most, FILL, SIDE);
        prop_assert!(crops.len() <= most.min(targets.len()));
        prop_assert!(crops.iter().all(|crop| crop.scale > 0.0 && crop.scale <= MAX_SCALE));
    }

    #[test]
    fn with_enough_crops_every_target_lies_in_one(targets in targets()) {
        let crops = place_crops(&targets, targets.len(), FILL, SIDE);
        for target in &targets {
            let is_served = |crop: &FrameCrop| shows(crop, target)
                && crop.turn.up().dot(&target.up) >= SERVED_COSINE;
            prop_assert!(crops.iter().any(is_served), "{target:?}");
        }
    }

    #[test]
    fn the_best_target_fills_the_wanted_share(targets in targets()) {
        prop_assume!(!targets.is_empty());
        let crop = place_crops(&targets, 1, FILL, SIDE)[0];
        let [x_min, y_min, x_max, y_max] = crop.crop_box(targets[0].bbox);
        let filled = (x_max - x_min).max(y_max - y_min) / f64::from(SIDE);
        prop_assert!(filled <= FILL + 1e-9, "{filled}");
        prop_assert!(crop.scale == MAX_SCALE || filled >= FILL * 0.999 || targets[0].extent() == MIN_EXTENT);
        prop_assert!(shows(&crop, &targets[0]));
    }
}

fn target(x: f64, y: f64, side: f64) -> CropTarget {
    CropTarget {
        bbox: [x, y, x + side, y + side],
        score: 0.5,
        up: -Vector2::y(),
    }
}

#[test]
fn neighbors_of_like_size_share_one_crop() {
    let near = [target(0.0, 0.0, 100.0), target(210.0, 190.0, 100.0)];
    assert_eq!(place_crops(&near, 9, FILL, SIDE).len(), 1);
    let far = [target(0.0, 0.0, 100.0), target(260.0, 0.0, 100.0)];
    assert_eq!(place_crops(&far, 9, FILL, SIDE).len(), 2);
    let unlike = [target(0.0, 0.0, 100.0), target(50.0, 0.0, 20.0)];
    assert_eq!(place_crops(&unlike, 9, FILL, SIDE).len(), 2);
}

#[test]
fn a_crop_moves_to_the_side_with_more_neighbors() {
    let crowd = [
        target(1000.0, 1000.0, 100.0),
        target(780.0, 1000.0, 100.0),
        target(1150.0, 1000.0, 100.0),
        target(1200.0, 1050.0, 100.0),
    ];
    let crops = place_crops(&crowd, 1, FILL, SIDE);
    assert!(shows(&crops[0], &crowd[2]) && shows(&crops[0], &crowd[3]));
    assert!(!shows(&crops[0], &crowd[1]));
}

/// The greatest and the least angle from straight down to the middles of the sides of the crop at
/// the nadir, degrees, of a camera tilted by `tilt`.
fn reach_of_nadir_crop(tilt: f64) -> Option<(f64, f64)> {
    let lens = Lens::equidistant_circle(499.5, 499.5, 500.0, 1.57).unwrap();
    let tilt = tilt.to_radians();
    let up = Unit::new_normalize(Ray::new(tilt.sin(), 0.0, -tilt.cos()));
    let mount = Mount::new(up, None);
    let crop = nadir_crop(&lens, &mount, SIDE)?;
    let half = f64::from(SIDE) / 2.0;
    let middles = [
        (half, 0.0),
        (half, 2.0 * half),
        (0.0, half),
        (2.0 * half, half),
    ];
    let angles = middles.map(|(x, y)| {
        let at = crop.frame_from_crop(&Pixel::new(x, y));
        let ray = lens.unproject(&to_pixel_center(at));
        ray.unwrap().angle(&mount.nadir()).to_degrees()
    });
    Some((
        angles.iter().copied().fold(0.0, f64::max),
        angles.iter().copied().fold(180.0, f64::min),
    ))
}

#[test]
fn the_crop_at_the_nadir_shows_what_is_below_the_camera() {
    let (greatest, least) = reach_of_nadir_crop(0.0).unwrap();
    assert!((greatest - 37.0).abs() < 0.1 && (least - 37.0).abs() < 0.1);
    let (greatest, least) = reach_of_nadir_crop(30.0).unwrap();
    assert!(greatest < 43.0 && least > 30.0, "{greatest} {least}");
    assert_eq!(reach_of_nadir_crop(95.0), None);
}

use proptest::prelude::*;

use super::*;

fn crops() -> impl Strategy<Value = FrameCrop> {
    let turn = prop::sample::select(QuarterTurn::ALL.to_vec());
    let side = -500.0..3000.0_f64;
    (
        turn,
        any::<bool>(),
        side.clone(),
        side,
        0.05..8.0_f64,
        1..1000_u32,
        1..1000_u32,
    )
        .prop_map(
            |(turn, is_mirrored, x, y, scale, width, height)| FrameCrop {
                is_mirrored,
                turn,
                center: Pixel::new(x, y),
                scale,
                width,
                height,
            },
        )
}

fn boxes() -> impl Strategy<Value = [f64; 4]> {
    let side = || 0.0..1000.0_f64;
    (side(), side(), side(), side())
        .prop_map(|(x, y, to_x, to_y)| [x.min(to_x), y.min(to_y), x.max(to_x), y.max(to_y)])
}

fn area([x_min, y_min, x_max, y_max]: [f64; 4]) -> f64 {
    (x_max - x_min) * (y_max - y_min)
}

proptest! {
    #[test]
    fn boxes_come_back_from_the_frame_as_they_were(crop in crops(), bbox in boxes()) {
        let back = crop.crop_box(crop.frame_box(bbox));
        for (side, expected) in back.into_iter().zip(bbox) {
            prop_assert!((side - expected).abs() < 1e-8, "{back:?} for {bbox:?}");
        }
    }

    #[test]
    fn a_box_keeps_its_area_up_to_the_scale(crop in crops(), bbox in boxes()) {
        let expected = area(bbox) / crop.scale.powi(2);
        let mapped = area(crop.frame_box(bbox));
        prop_assert!((mapped - expected).abs() <= 1e-7 * expected.max(1.0), "{mapped} {expected}");
    }

    #[test]
    fn every_corner_of_a_box_lies_on_a_corner_of_its_footprint(crop in crops(), bbox in boxes()) {
        let [x_min, y_min, x_max, y_max] = crop.frame_box(bbox);
        for (x, y) in [(0, 1), (2, 1), (2, 3), (0, 3)] {
            let corner = crop.frame_from_crop(&Pixel::new(bbox[x], bbox[y]));
            let off = |value: f64, low: f64, high: f64| (value - low).abs().min((value - high).abs());
            prop_assert!(off(corner.x, x_min, x_max) < 1e-8, "{corner}");
            prop_assert!(off(corner.y, y_min, y_max) < 1e-8, "{corner}");
        }
    }

    #[test]
    fn the_nearest_turn_is_within_an_eighth_turn_of_up(angle in -4.0..4.0_f64) {
        let up = Vector2::new(angle.sin(), -angle.cos());
        let cosine = QuarterTurn::nearest(up * 3.0).up().dot(&up);
        prop_assert!(cosine >= std::f64::consts::FRAC_1_SQRT_2 - 1e-12, "{cosine}");
    }
}

#[test]
fn quarter_turns_are_clockwise_and_have_inverses() {
    let ups = QuarterTurn::ALL.map(|turn| <[f64; 2]>::from(turn.up()));
    assert_eq!(ups, [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]);
    for turn in QuarterTurn::ALL {
        let vector = Vector2::new(3.0, -7.0);
        assert_eq!(turn.inverse().turned(turn.turned(vector)), vector);
    }
}

#[test]
fn a_mirrored_crop_exchanges_left_and_right_of_the_same_part() {
    let crop = FrameCrop {
        turn: QuarterTurn::Right,
        is_mirrored: false,
        center: Pixel::new(100.0, 50.0),
        scale: 2.0,
        width: 40,
        height: 20,
    };
    let mirrored = crop.mirrored();
    assert_eq!(mirrored.bounds(), crop.bounds());
    for (x, y) in [(0.0, 0.0), (3.0, 20.0), (31.0, 7.0)] {
        let position = mirrored.frame_from_crop(&Pixel::new(x, y));
        assert_eq!(position, crop.frame_from_crop(&Pixel::new(40.0 - x, y)));
    }
    assert_eq!(mirrored.mirrored(), crop);
}

#[test]
fn a_crop_holds_what_lies_within_its_bounds() {
    let crop = FrameCrop {
        is_mirrored: false,
        turn: QuarterTurn::Right,
        center: Pixel::new(100.0, 50.0),
        scale: 2.0,
        width: 40,
        height: 20,
    };
    assert_eq!(crop.bounds(), [95.0, 40.0, 105.0, 60.0]);
    assert!(crop.holds(&Pixel::new(96.0, 59.0)));
    assert!(!crop.holds(&Pixel::new(94.0, 50.0)));
    assert!(!crop.holds(&Pixel::new(100.0, 61.0)));
}

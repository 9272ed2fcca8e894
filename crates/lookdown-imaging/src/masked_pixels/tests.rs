use nalgebra::Point2;
use proptest::prelude::*;

use super::*;

const WIDTH: u32 = 40;
const HEIGHT: u32 = 30;

fn white() -> Frame {
    Frame::new(
        WIDTH,
        HEIGHT,
        vec![255; 3 * WIDTH as usize * HEIGHT as usize],
    )
    .unwrap()
}

fn masked(polygons: &[&[[f64; 2]]]) -> MaskedPixels {
    let polygons: Vec<_> = polygons
        .iter()
        .map(|corners| Polygon::new(corners).unwrap())
        .collect();
    MaskedPixels::new(&polygons, WIDTH, HEIGHT)
}

/// Columns and rows of the black pixels of a frame.
fn black(frame: &Frame) -> Vec<(u32, u32)> {
    let places = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
    places
        .filter(|&(x, y)| frame.pixel(x, y) == [0; 3])
        .collect()
}

#[test]
fn a_rectangle_along_pixel_borders_blanks_exactly_its_pixels() {
    let masked = masked(&[&[[10.0, 5.0], [13.0, 5.0], [13.0, 7.0], [10.0, 7.0]]]);
    let mut frame = white();
    masked.blank(&mut frame);
    assert_eq!(
        black(&frame),
        [(10, 5), (11, 5), (12, 5), (10, 6), (11, 6), (12, 6)]
    );
    assert_eq!(masked.count(), 6);
    assert!(masked.hides_position(Pixel::new(12.4, 4.6)));
    assert!(!masked.hides_position(Pixel::new(12.6, 4.6)));
    assert!(!masked.hides_position(Pixel::new(-20.0, 5.0)));
}

#[test]
fn a_pixel_is_blanked_however_little_of_it_is_covered() {
    let masked = masked(&[&[[10.9, 5.9], [12.1, 5.9], [12.1, 6.1], [10.9, 6.1]]]);
    let mut frame = white();
    masked.blank(&mut frame);
    assert_eq!(
        black(&frame),
        [(10, 5), (11, 5), (12, 5), (10, 6), (11, 6), (12, 6)]
    );
}

#[test]
fn masks_are_clipped_and_overlapping_masks_count_once() {
    let far: &[[f64; 2]] = &[[-1e6, -1e6], [1e6, -1e6], [1e6, 1e6], [-1e6, 1e6]];
    let near: &[[f64; 2]] = &[[1.0, 1.0], [9.0, 1.0], [9.0, 9.0]];
    let masked = masked(&[near, far, near]);
    assert_eq!(masked.count(), u64::from(WIDTH * HEIGHT));
    let mut frame = white();
    masked.blank(&mut frame);
    assert_eq!(black(&frame).len(), (WIDTH * HEIGHT) as usize);
}

#[test]
fn without_masks_a_frame_stays_as_it_is() {
    let masked = masked(&[]);
    assert!(masked.is_empty() && !masked.hides(0, 0) && masked.bytes() == 0);
    let mut frame = white();
    masked.blank(&mut frame);
    assert_eq!(frame, white());
}

proptest! {
    /// Thin and wide triangles, some of them partly outside the frame.
    #[test]
    fn pixels_inside_are_blanked_and_pixels_further_out_are_not(
        corners in prop::array::uniform3(prop::array::uniform2(-10.0..50.0_f64)),
        places in prop::collection::vec((0.0..f64::from(WIDTH), 0.0..f64::from(HEIGHT)), 50),
    ) {
        let polygon = Polygon::new(&corners);
        prop_assume!(polygon.is_ok());
        let polygon = polygon.unwrap();
        let masked = MaskedPixels::new(std::slice::from_ref(&polygon), WIDTH, HEIGHT);
        for (x, y) in places {
            let is_masked = masked.hides(to_u32(x.floor()), to_u32(y.floor()));
            if polygon.holds(Point2::new(x, y)) {
                prop_assert!(is_masked, "{x} {y} is inside");
            }
            let near = Polygon::new(&[
                [x - 1.5, y - 1.5], [x + 1.5, y - 1.5], [x + 1.5, y + 1.5], [x - 1.5, y + 1.5],
            ]);
            if !polygon.meets(&near.unwrap()) {
                prop_assert!(!is_masked, "{x} {y} is far outside");
            }
        }
    }
}

//! Construction, geometry and refusals of boxes.

use super::{BBox, BBoxError, FramePixels};

fn frame_box(corners: [f64; 4]) -> BBox<FramePixels> {
    BBox::new(corners).unwrap()
}

#[test]
fn coordinates_that_are_not_numbers_are_refused() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1.1e9] {
        for position in 0..4 {
            let mut corners = [0.0, 0.0, 1.0, 1.0];
            corners[position] = bad;
            let refusal = BBox::<FramePixels>::new(corners).unwrap_err();
            assert!(matches!(refusal, BBoxError::Coordinate(_)), "{refusal}");
        }
    }
}

#[test]
fn an_inverted_box_is_refused_on_either_axis() {
    for corners in [[2.0, 0.0, 1.0, 1.0], [0.0, 2.0, 1.0, 1.0]] {
        assert_eq!(
            BBox::<FramePixels>::new(corners),
            Err(BBoxError::Inverted(corners))
        );
    }
}

#[test]
fn errors_name_the_given_and_the_expected_coordinates() {
    assert_eq!(
        BBoxError::Coordinate(f64::NAN).to_string(),
        "box coordinate NaN is not a pixel position; use finite numbers within ±1e9"
    );
}

#[test]
fn sides_area_and_center_are_continuous() {
    let bbox = frame_box([10.0, 20.0, 30.0, 50.0]);
    assert_eq!(
        (bbox.width(), bbox.height(), bbox.area(), bbox.center()),
        (20.0, 30.0, 600.0, [20.0, 35.0])
    );
}

#[test]
fn half_covered_boxes_of_equal_size_overlap_by_a_third() {
    let left = frame_box([0.0, 0.0, 2.0, 1.0]);
    let right = frame_box([1.0, 0.0, 3.0, 1.0]);
    assert!((left.iou(&right) - 1.0 / 3.0).abs() < 1e-15);
}

#[test]
fn diagonal_neighbors_do_not_overlap() {
    let here = frame_box([0.0, 0.0, 1.0, 1.0]);
    let there = frame_box([5.0, 5.0, 6.0, 6.0]);
    assert!(here.intersection_area(&there) <= 0.0);
    assert!(here.iou(&there) <= 0.0);
}

#[test]
fn boxes_without_area_overlap_nothing_not_even_themselves() {
    let point = frame_box([3.0, 3.0, 3.0, 3.0]);
    assert!(point.iou(&point) <= 0.0);
}

#[test]
fn clipping_keeps_the_part_inside() {
    let frame = frame_box([0.0, 0.0, 100.0, 80.0]);
    let crossing = frame_box([-5.0, 70.0, 10.0, 90.0]);
    assert_eq!(
        crossing.clipped_to(&frame),
        Some(frame_box([0.0, 70.0, 10.0, 80.0]))
    );
    assert_eq!(
        frame_box([100.0, 0.0, 110.0, 10.0]).clipped_to(&frame),
        None
    );
}

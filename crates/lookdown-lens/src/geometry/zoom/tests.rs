use std::f64::consts::FRAC_PI_3;

use super::*;

const SIZE: u32 = 416;
const FILL: f64 = 0.35;

/// The outline of something `half` radians wide and twice as high, `theta` off straight down
/// toward image right.
fn outline(theta: f64, half: f64) -> Vec<Ray> {
    let at = |across: f64, along: f64| {
        let theta = theta + along;
        Ray::new(theta.sin(), across.sin(), theta.cos())
    };
    vec![
        at(half, 0.0),
        at(-half, 0.0),
        at(0.0, 2.0 * half),
        at(0.0, -2.0 * half),
    ]
}

fn views(outlines: &[Vec<Ray>], most: usize) -> Vec<VirtualView> {
    zoomed_views(outlines, most, FILL, &Mount::default(), [SIZE, SIZE])
}

#[test]
fn person_is_upright_centred_and_fills_the_given_share() {
    let person = outline(FRAC_PI_3, 0.05);
    let view = &views(std::slice::from_ref(&person), 5)[0];
    let seen: Vec<_> = person
        .iter()
        .map(|ray| view.project(ray).unwrap())
        .collect();
    let middle = f64::from(SIZE - 1) / 2.0;
    let [right, left, outer, inner] = [0, 1, 2, 3].map(|index| seen[index]);
    // Outward of the camera is up in the picture: the far end of the person is the head.
    assert!(outer.y < inner.y);
    assert!((outer.x - middle).abs() < 1.0 && (inner.x - middle).abs() < 1.0);
    assert!((f64::midpoint(outer.y, inner.y) - middle).abs() < 1.0);
    assert!((f64::midpoint(right.x, left.x) - middle).abs() < 1.0);
    let height = (outer.y - inner.y).abs() / f64::from(SIZE);
    assert!((height - FILL).abs() < 0.01, "{height}");
}

#[test]
fn people_side_by_side_share_a_view_and_those_apart_do_not() {
    let person = outline(1.0, 0.05);
    let neighbour = outline(1.02, 0.05);
    let far_away = outline(-1.0, 0.05);
    let giant = outline(1.0, 0.3);
    assert_eq!(views(&[person.clone(), neighbour], 5).len(), 1);
    assert_eq!(views(&[person.clone(), far_away], 5).len(), 2);
    assert_eq!(views(&[person, giant], 5).len(), 2);
}

#[test]
fn no_more_views_than_allowed_and_the_best_outlines_first() {
    let outlines: Vec<_> = (0..6)
        .map(|index| outline(f64::from(index) * 0.25 - 0.6, 0.02))
        .collect();
    let all = views(&outlines, 10);
    assert_eq!(all.len(), 6);
    assert_eq!(views(&outlines, 4), all[..4]);
    assert!(views(&outlines, 0).is_empty());
}

#[test]
fn a_person_straight_below_is_looked_at_straight_down() {
    let person = vec![
        Ray::new(0.2, 0.0, 1.0),
        Ray::new(-0.2, 0.0, 1.0),
        Ray::new(0.0, 0.2, 1.0),
        Ray::new(0.0, -0.2, 1.0),
    ];
    let view = &views(&[person], 1)[0];
    let axis = view.camera_from_view() * Ray::z();
    assert!((axis - Ray::z()).norm() < 1e-9, "{axis}");
    let up = view.camera_from_view().inverse_transform_vector(&-Ray::y());
    assert!(
        (up + Ray::y()).norm() < 1e-9,
        "image up stays the frame's: {up}"
    );
}

#[test]
fn outlines_all_around_the_camera_are_left_out() {
    let around = vec![Ray::x(), -Ray::x(), Ray::y(), -Ray::y()];
    assert!(views(&[around, Vec::new()], 3).is_empty());
}

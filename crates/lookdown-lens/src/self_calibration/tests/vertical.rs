//! The vertical: cameras on ceilings and on walls.

use nalgebra::Rotation3;

use super::{CENTER, assert_level, circle, edges, equisolid, ray};
use crate::{
    geometry::Ray,
    self_calibration::{FitRefusal, KnownCamera, RoomFit},
};

#[test]
fn camera_tilted_by_53_degrees_is_upright() {
    let room = Rotation3::from_euler_angles(0.92, 0.0, 0.0);
    let all = vec![edges(&room); 2].concat();
    let fit = RoomFit::new(&[all], &[circle()], KnownCamera::default()).unwrap();
    assert_level(&fit, &room, 0.5);
}

#[test]
fn vertical_of_a_tilted_camera_needs_many_edges() {
    let room = Rotation3::from_euler_angles(0.92, 0.0, 0.0);
    // Few edges are above the horizon of another direction, so that it may be the vertical.
    let mut above = 0;
    let mut few = edges(&room);
    few.retain(|curve| {
        let middle = ray(curve.points[curve.points.len() / 2]);
        let is_above = middle.dot(&(room * Ray::y())) < -0.15;
        above += usize::from(is_above);
        !is_above || above % 5 == 0
    });
    let fit = |copies: usize| {
        let edges = vec![few.clone(); copies].concat();
        RoomFit::new(&[edges], &[circle()], KnownCamera::default())
    };
    assert_eq!(fit(3), Err(FitRefusal::VerticalUnclear));
    let many = fit(20).unwrap();
    assert_level(&many, &room, 0.5);
}

#[test]
fn camera_on_a_wall_has_no_clear_vertical() {
    let room = Rotation3::from_euler_angles(-0.92, 0.0, 0.0);
    let away = room * -Ray::y();
    let is_before = |point: &[f64; 2]| ray(*point).dot(&away) > 0.1;
    let mut before = edges(&room);
    before.retain(|curve| curve.points.iter().all(is_before));
    let all = vec![before; 4].concat();
    let fit = RoomFit::new(&[all], &[circle()], KnownCamera::default());
    assert_eq!(fit, Err(FitRefusal::VerticalUnclear));
}

#[test]
fn camera_that_looks_horizontally_is_refused() {
    // Toward a wall of the room, with the floor at the bottom of the image and no edges above.
    let room = Rotation3::from_euler_angles(-1.55, 0.0, 0.0);
    let mut below = vec![edges(&room); 3].concat();
    below.retain(|curve| curve.points.iter().all(|[_, y]| *y > CENTER[1] + 20.0));
    let fit = RoomFit::new(&[below], &[circle()], KnownCamera::default());
    assert_eq!(fit, Err(FitRefusal::VerticalUnclear));
}

#[test]
fn camera_beside_a_plain_wall_is_fitted_if_it_is_on_a_ceiling() {
    let room = Rotation3::from_euler_angles(0.14, -0.09, 0.0);
    let mut before = vec![edges(&room); 3].concat();
    before.retain(|curve| {
        let middle = ray(curve.points[curve.points.len() / 2]);
        middle.dot(&(room * Ray::y())) < 0.15
    });
    let fit = |known| RoomFit::new(std::slice::from_ref(&before), &[circle()], known);
    assert_eq!(fit(equisolid()), Err(FitRefusal::VerticalUnclear));
    let known = KnownCamera {
        is_on_ceiling: true,
        ..equisolid()
    };
    assert_level(&fit(known).unwrap(), &room, 0.5);
}

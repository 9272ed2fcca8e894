//! The edges that follow the directions of a fitted room.

use nalgebra::Rotation3;

use super::{circle, clutter, edges};
use crate::{
    geometry::Ray,
    self_calibration::{EdgeCurve, KnownCamera, RoomFit},
};

#[test]
fn edges_are_assigned_to_their_directions() {
    let room = Rotation3::from_euler_angles(0.14, -0.09, 0.4);
    let walls = edges(&room);
    let all = [walls.clone(), clutter(100)].concat();
    let fit = RoomFit::new(
        std::slice::from_ref(&all),
        &[circle()],
        KnownCamera::default(),
    )
    .unwrap();
    let along = fit.edges_along(&all);
    // Of seven edges of the room, four are vertical, one is along y and two are along x.
    let is_x_first = fit.directions[1].dot(&(room * Ray::x())).abs() > 0.9;
    let expected = |index: usize| match (index % 7, is_x_first) {
        (0..4, _) => 0,
        (4, true) | (5.., false) => 2,
        (4, false) | (5.., true) => 1,
    };
    for (index, edge) in walls.iter().enumerate() {
        let is_along = |direction: usize| along[direction].contains(&edge);
        assert!(is_along(expected(index)), "edge {index}");
    }
    let is_wall = |edge: &&EdgeCurve| walls.contains(edge);
    let clutter = along.iter().flatten().filter(|edge| !is_wall(edge)).count();
    assert!(
        clutter < 30,
        "{clutter} of 100 edges of clutter follow the room"
    );
}

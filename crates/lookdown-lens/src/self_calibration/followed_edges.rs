//! The edges that follow the directions of a fitted room.

use nalgebra::{Matrix3, Rotation3};

use super::{
    camera::{Angles, RoomCamera, ideal_shape},
    edge_curve::EdgeCurve,
    evidence::followed_direction,
    fit::RoomFit,
};

impl RoomFit {
    /// Returns the edges that follow each of the directions, in the order of the directions. Edges
    /// that follow none of them are left out.
    pub fn edges_along<'a>(&self, edges: &'a [EdgeCurve]) -> [Vec<&'a EdgeCurve>; 3] {
        let mut along: [Vec<&EdgeCurve>; 3] = Default::default();
        let camera = RoomCamera::from(self);
        let (radius, _) = camera.curve(self.max_theta);
        if let Some(angles) = Angles::from_camera(&camera, self.focal * radius) {
            for edge in edges {
                if let Some(direction) = followed_direction(edge, &camera, &angles) {
                    along[direction].push(edge);
                }
            }
        }
        along
    }
}

impl From<&RoomFit> for RoomCamera {
    fn from(fit: &RoomFit) -> Self {
        let [k1, k2, ..] = fit.k;
        let [down, x, y] = fit.directions;
        let axes = Matrix3::from_columns(&[x, y, down]);
        Self {
            focal: fit.focal,
            k1,
            k2_offset: k2 - ideal_shape(k1)[1],
            center: fit.center,
            room: Rotation3::from_matrix_unchecked(axes),
        }
    }
}

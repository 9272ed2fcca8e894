//! The vertical among the three directions of a room.

use nalgebra::{Matrix3, Rotation3};

use super::{
    camera::{Angles, RoomCamera},
    edge_curve::EdgeCurve,
    evaluation::Evaluation,
};
use crate::geometry::Ray;

/// Largest angle between the vertical and the axis, degrees.
const MAX_TILT: f64 = 65.0;
/// Sine of the elevation from which an edge is above the horizon. Ceilings and their lamps may be
/// a little above the camera.
const ABOVE_HORIZON: f64 = 0.15;
/// Share of the edges by which fewer must be above the horizon of the vertical than above that of
/// another direction.
const CLEARLY_FEWER: f64 = 0.05;

/// Makes the direction the vertical that has the fewest edges above its horizon: a camera on a
/// ceiling sees little above itself. Returns false if another direction has nearly as few.
pub(super) fn upright(
    camera: &RoomCamera,
    curves: &[EdgeCurve],
    evaluation: &Evaluation,
    radius: f64,
) -> (RoomCamera, bool) {
    let directions = camera.directions();
    let candidates: Vec<Ray> = directions
        .iter()
        .flat_map(|direction| [*direction, -direction])
        .filter(|direction| direction.angle(&Ray::z()) < MAX_TILT.to_radians())
        .collect();
    if candidates.len() < 2 {
        return (camera.clone(), true);
    }
    let Some(angles) = Angles::of(camera, radius) else {
        return (camera.clone(), true);
    };
    let mut above = vec![0.0; candidates.len()];
    let mut total = 0.0;
    for (curve, explained) in curves.iter().zip(&evaluation.explained) {
        let ray = angles.ray(camera, curve.points[curve.points.len() / 2]).ray;
        let weight = explained * curve.length();
        total += weight;
        for (above, direction) in above.iter_mut().zip(&candidates) {
            if ray.dot(direction) < -ABOVE_HORIZON {
                *above += weight;
            }
        }
    }
    let mut order: Vec<usize> = (0..candidates.len()).collect();
    order.sort_by(|a, b| above[*a].total_cmp(&above[*b]));
    let down = candidates[order[0]];
    let is_clear = above[order[1]] - above[order[0]] > CLEARLY_FEWER * total;
    let across = directions
        .into_iter()
        .find(|direction| direction.dot(&down).abs() < 0.5)
        .unwrap_or(directions[1]);
    let axes = Matrix3::from_columns(&[across, down.cross(&across), down]);
    let camera = RoomCamera {
        room: Rotation3::from_matrix_unchecked(axes),
        ..camera.clone()
    };
    (camera, is_clear)
}

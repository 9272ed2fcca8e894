//! The vertical among the three directions of a room.

use nalgebra::{Matrix3, Rotation3};

use super::{
    camera::{Angles, RoomCamera},
    edge_curve::EdgeCurve,
    evaluation::Evaluation,
    prior::Prior,
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
/// A camera may look horizontally from a wall if no larger share of the edges is above the horizon
/// of a direction beside the image, which then points to a plain ceiling or floor. The share is
/// larger for the top and the bottom of the image, as cameras on walls are mounted upright.
const MAX_PLAIN: f64 = 0.06;
const MAX_PLAIN_UPRIGHT: f64 = 0.2;
/// Least cosine of the angle between a direction and the top or bottom of the image.
const MIN_UPRIGHT: f64 = 0.94;

/// Makes the direction the vertical that has the fewest edges above its horizon: a camera on a
/// ceiling sees little above itself. Returns false if another direction may be the vertical.
pub(super) fn upright(
    camera: &RoomCamera,
    curves: &[EdgeCurve],
    evaluation: &Evaluation,
    prior: &Prior,
) -> (RoomCamera, bool) {
    let directions = camera.directions();
    let signed = directions
        .iter()
        .flat_map(|direction| [*direction, -direction]);
    let (candidates, beside): (Vec<Ray>, Vec<Ray>) = signed
        .filter(|direction| direction.z > -MAX_TILT.to_radians().cos())
        .partition(|direction| direction.angle(&Ray::z()) < MAX_TILT.to_radians());
    let Some(angles) = Angles::from_camera(camera, prior.radius) else {
        return (camera.clone(), true);
    };
    let above = |direction: &Ray| share_above(direction, camera, &angles, curves, evaluation);
    let may_be_on_wall = !prior.is_on_ceiling
        && beside.iter().any(|direction| {
            let is_upright = direction.y.abs() > MIN_UPRIGHT;
            let most = if is_upright {
                MAX_PLAIN_UPRIGHT
            } else {
                MAX_PLAIN
            };
            above(direction) < most
        });
    let mut order: Vec<(Ray, f64)> = candidates.iter().map(|ray| (*ray, above(ray))).collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    let (down, second) = match order[..] {
        [] | [_] => return (camera.clone(), !may_be_on_wall),
        [first, second, ..] => (first, second),
    };
    let edges: f64 = evaluation.explained.iter().sum();
    let is_clear = second.1 - down.1 > CLEARLY_FEWER.max(1.0 / edges.max(1.0).sqrt());
    let down = down.0;
    let across = directions
        .into_iter()
        .find(|direction| direction.dot(&down).abs() < 0.5)
        .unwrap_or(directions[1]);
    let axes = Matrix3::from_columns(&[across, down.cross(&across), down]);
    let camera = RoomCamera {
        room: Rotation3::from_matrix_unchecked(axes),
        ..camera.clone()
    };
    (camera, is_clear && !may_be_on_wall)
}

/// The share of the edges along the directions of the room that is above the horizon if this
/// direction is down.
fn share_above(
    down: &Ray,
    camera: &RoomCamera,
    angles: &Angles,
    curves: &[EdgeCurve],
    evaluation: &Evaluation,
) -> f64 {
    let (mut above, mut total) = (0.0, 0.0);
    for (curve, explained) in curves.iter().zip(&evaluation.explained) {
        let ray = angles.ray(camera, curve.points[curve.points.len() / 2]).ray;
        let weight = explained * curve.length();
        total += weight;
        if ray.dot(down) < -ABOVE_HORIZON {
            above += weight;
        }
    }
    above / f64::max(total, 1e-9)
}

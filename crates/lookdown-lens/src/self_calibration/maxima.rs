//! The maxima of the evidence: starts, those that are followed, and rivals.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::{
    camera::{Angles, RoomCamera},
    evidence::{EdgeCurve, evaluate},
    known_camera::KnownCamera,
    prior::{Evaluation, Parameters, Prior},
    search,
    uncertainty::{curvature, distance, radius_step},
};
use crate::geometry::Ray;

/// Curves of the first steps: the longest.
const COARSE_CURVES: usize = 300;
/// Starts that are followed.
const COARSE_STARTS: usize = 12;
/// Maxima that are followed with all curves.
const FINE_STARTS: usize = 4;
/// Most steps to a maximum with all curves.
const FINE_STEPS: usize = 12;
/// Standard deviations of the radius by which two further starts are beside the best maximum.
const ASIDE: f64 = 3.0;
/// Standard deviation of the radius, as a share, from which further starts look for rivals.
const FLAT: f64 = 0.006;
/// Vertical scales of the room of these starts.
const STRETCHES: [f64; 4] = [0.8, 0.9, 1.12, 1.25];
/// Most rounds of these starts: a further one only if one of them was better.
const STRETCH_ROUNDS: usize = 2;

/// A maximum of the evidence.
pub(super) struct Maximum {
    pub(super) camera: RoomCamera,
    pub(super) evaluation: Evaluation,
    /// False if another direction may as well be the vertical.
    pub(super) is_upright: bool,
}

impl Maximum {
    fn new(camera: RoomCamera, evaluation: Evaluation) -> Self {
        Self {
            camera,
            evaluation,
            is_upright: true,
        }
    }

    /// The share of the edges along the three directions.
    pub(super) fn explained(&self) -> f64 {
        self.evaluation.shares.iter().sum()
    }
}

/// The best maxima, best first, each different from the others.
pub(super) fn maxima(
    curves: &[EdgeCurve],
    weight: f64,
    prior: &Prior,
    known: KnownCamera,
) -> Vec<Maximum> {
    let mut longest = curves.to_vec();
    longest.sort_by_key(|segment| std::cmp::Reverse(segment.points.len()));
    longest.truncate(COARSE_CURVES);
    let weights = vec![weight; curves.len()];
    let mut coarse: Vec<Maximum> = Vec::new();
    for start in search::starts(&longest, prior, known) {
        let mut found = None;
        let mut camera = start;
        for (blur, steps) in [(6.0, 5), (3.0, 5), (1.5, 6)] {
            found = climb(camera.clone(), &longest, &weights, prior, blur, steps);
            let Some((next, _)) = &found else { break };
            camera = next.clone();
        }
        coarse.extend(found.map(|(camera, evaluation)| Maximum::new(camera, evaluation)));
        if coarse.len() == COARSE_STARTS {
            break;
        }
    }
    best_first(&mut coarse);
    let starts = coarse.into_iter().map(|maximum| maximum.camera);
    fine_maxima(starts, curves, weight, prior)
}

/// The maxima next to starts, best first.
pub(super) fn fine_maxima(
    starts: impl Iterator<Item = RoomCamera>,
    curves: &[EdgeCurve],
    weight: f64,
    prior: &Prior,
) -> Vec<Maximum> {
    let weights = vec![weight; curves.len()];
    let mut fine: Vec<Maximum> = Vec::new();
    let mut tried: Vec<RoomCamera> = Vec::new();
    for camera in starts {
        let is_known = tried.iter().any(|other| {
            let (radius, level) = distance(&camera, other);
            radius < 0.01 && level < 0.02
        });
        if is_known || tried.len() == FINE_STARTS {
            continue;
        }
        tried.push(camera.clone());
        fine.extend(followed(camera, curves, &weights, prior));
    }
    best_first(&mut fine);
    if let Some(best) = fine.first() {
        let sides = [-ASIDE, ASIDE].map(|deviations| aside(best, deviations));
        for start in sides.into_iter().flatten() {
            let found = climb(start, curves, &weights, prior, 1.0, FINE_STEPS);
            fine.extend(found.map(|(camera, evaluation)| Maximum::new(camera, evaluation)));
        }
        best_first(&mut fine);
    }
    add_stretched(&mut fine, curves, &weights, prior);
    for maximum in &mut fine {
        (maximum.camera, maximum.is_upright) =
            upright(&maximum.camera, curves, &maximum.evaluation, prior);
    }
    fine
}

/// The maximum that is reached from a camera.
fn followed(
    camera: RoomCamera,
    curves: &[EdgeCurve],
    weights: &[f64],
    prior: &Prior,
) -> Option<Maximum> {
    let (camera, _) = climb(camera, curves, weights, prior, 1.5, 4)?;
    let (camera, evaluation) = climb(camera, curves, weights, prior, 1.0, FINE_STEPS)?;
    Some(Maximum::new(camera, evaluation))
}

/// The camera that the edges like best among those with another radius.
fn aside(maximum: &Maximum, deviations: f64) -> Option<RoomCamera> {
    let step = radius_step(&maximum.camera, &maximum.evaluation)?;
    Some(stepped(&maximum.camera, &(step * deviations)))
}

/// Adds the maxima that are reached from stretched cameras, where the edges hardly determine the
/// lens, and sorts all of them. If a camera looks straight down, a room of another height with
/// another lens has nearly the same edges.
fn add_stretched(fine: &mut Vec<Maximum>, curves: &[EdgeCurve], weights: &[f64], prior: &Prior) {
    for _ in 0..STRETCH_ROUNDS {
        let Some(best) = fine.first().filter(|best| is_flat(best)) else {
            break;
        };
        let (camera, evidence) = (best.camera.clone(), best.evaluation.evidence);
        for start in STRETCHES
            .iter()
            .filter_map(|share| camera.stretched(*share))
        {
            fine.extend(followed(start, curves, weights, prior));
        }
        best_first(fine);
        if fine[0].evaluation.evidence < evidence + 1.0 {
            break;
        }
    }
}

fn best_first(maxima: &mut [Maximum]) {
    maxima.sort_by(|a, b| b.evaluation.evidence.total_cmp(&a.evaluation.evidence));
}

/// Returns true if the edges hardly determine the lens.
fn is_flat(maximum: &Maximum) -> bool {
    curvature(&maximum.camera, &maximum.evaluation)
        .is_none_or(|uncertainty| uncertainty.radius > FLAT)
}

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
fn upright(
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
    let Some(angles) = Angles::from_camera(camera, prior.circle.radius) else {
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

/// Growth of the steps after each success, and their greatest length, in those of Gauss and Newton.
/// These are too short where edges are about to follow another direction or none.
const LONGER: f64 = 1.6;
const LONGEST: f64 = 8.0;

/// The camera after a step of its parameters.
pub(super) fn stepped(camera: &RoomCamera, step: &Parameters) -> RoomCamera {
    RoomCamera {
        focal: camera.focal * step[0].exp(),
        k1: camera.k1 + step[1],
        k2_offset: camera.k2_offset + step[2],
        center: [camera.center[0] + step[3], camera.center[1] + step[4]],
        room: Rotation3::new(Vector3::new(step[5], step[6], step[7])) * camera.room,
    }
}

/// Climbs to the nearest maximum of the evidence (Levenberg-Marquardt).
pub(super) fn climb(
    mut camera: RoomCamera,
    curves: &[EdgeCurve],
    weights: &[f64],
    prior: &Prior,
    blur: f64,
    steps: usize,
) -> Option<(RoomCamera, Evaluation)> {
    let mut current = evaluate(&camera, curves, weights, prior, blur, true)?;
    let (mut damping, mut stride) = (1e-3, 1.0);
    for _ in 0..steps {
        let mut damped = current.normal;
        for index in 0..damped.nrows() {
            damped[(index, index)] *= 1.0 + damping;
        }
        let Some(cholesky) = damped.cholesky() else {
            break;
        };
        let step = stride * cholesky.solve(&current.right);
        let next = stepped(&camera, &step);
        match evaluate(&next, curves, weights, prior, blur, true) {
            Some(evaluation) if evaluation.evidence > current.evidence => {
                let gain = evaluation.evidence - current.evidence;
                (camera, current) = (next, evaluation);
                damping = (damping * 0.2).max(1e-6);
                stride = (stride * LONGER).min(LONGEST);
                if gain < 1e-3 {
                    break;
                }
            }
            _ if stride > 1.0 => stride = 1.0,
            _ => {
                damping *= 10.0;
                if damping > 1e4 {
                    break;
                }
            }
        }
    }
    Some((camera, current))
}

//! The way to the nearest maximum of the evidence.

use nalgebra::{Rotation3, Vector3};

use super::{
    camera::RoomCamera,
    evidence::{EdgeCurve, evaluate},
    prior::{Evaluation, Parameters, Prior},
};

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

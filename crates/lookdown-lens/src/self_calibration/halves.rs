//! Fits of halves of the edges: whether they like another camera much better.

use super::{
    camera::RoomCamera,
    climb::climb,
    edge_curve::EdgeCurve,
    evidence::evaluate,
    prior::Prior,
    uncertainty::{FitUncertainty, distance, loose_curvature},
};

/// Most steps of a fit.
const STEPS: usize = 12;
/// Halves disagree if one of them gains more evidence.
const MAX_GAIN: f64 = 10.0;
/// Differences of the radius and of the level, degrees, that are not a disagreement.
const NEAR: (f64, f64) = (0.03, 2.0);
/// Neither are differences within so many standard deviations of the half.
const DEVIATIONS: f64 = 2.5;

/// The camera of half of the edges, beside that of all of them.
pub(super) struct Half {
    /// Evidence of the half for its own camera, beyond that for the camera of all.
    gain: f64,
    /// Difference of the radius, as a share.
    pub radius: f64,
    /// Difference of the level, degrees.
    pub level_deg: f64,
    /// Standard deviations of the half.
    own: FitUncertainty,
}

impl Half {
    /// Returns true if the half clearly shows another camera.
    pub(super) fn disagrees(&self) -> bool {
        let is_far = self.radius > NEAR.0.max(DEVIATIONS * self.own.radius)
            || self.level_deg > NEAR.1.max(DEVIATIONS * self.own.level_deg);
        is_far && self.gain > MAX_GAIN
    }
}

/// Fits two interleaved halves of the edges, then those of two halves of the image.
pub(super) fn halves(
    camera: &RoomCamera,
    curves: &[EdgeCurve],
    weight: f64,
    prior: &Prior,
) -> Option<Vec<Half>> {
    let fitted = |half: usize| {
        let weights: Vec<f64> = curves
            .iter()
            .enumerate()
            .map(|(index, curve)| {
                let side = match half {
                    0 | 1 => index % 2 == half,
                    _ => (curve.points[0][0] < camera.center[0]) == (half == 2),
                };
                if side { weight } else { 0.0 }
            })
            .collect();
        let before = evaluate(camera, curves, &weights, prior, 1.0, false)?;
        let (other, evaluation) = climb(camera.clone(), curves, &weights, prior, 1.0, STEPS)?;
        let (radius, level) = distance(camera, &other);
        Some(Half {
            gain: evaluation.evidence - before.evidence,
            radius,
            level_deg: level.to_degrees(),
            own: loose_curvature(&other, &evaluation, prior)?,
        })
    };
    (0..4).map(fitted).collect()
}

//! Standard deviations from a bootstrap over the edges.
//!
//! A fit to edges that are drawn again, with replacement, moves by one step of Newton,
//! `H^-1 (sum of m_i g_i)`: `H` is the curvature of the evidence, `g_i` the slope of the evidence
//! of group `i`, and `m_i` how often it was drawn. The covariance of these steps is
//! `H^-1 S H^-1` with the scatter `S` of the slopes (B. Efron, "Bootstrap methods: another look at
//! the jackknife", Annals of Statistics 7 (1), 1979), so nothing has to be drawn.

use super::{
    camera::RoomCamera,
    edge_curve::EdgeCurve,
    evaluation::{Evaluation, Normal, Parameters},
    evidence::evaluate,
    prior::Prior,
    uncertainty::{FitUncertainty, deviations, loose_covariance},
};

/// Groups of edges. Edges of one thing are neighbors, and neighbors are in one group.
const GROUPS: usize = 40;

/// Standard deviations of the fit with this evaluation.
pub(super) fn bootstrap(
    camera: &RoomCamera,
    curves: &[EdgeCurve],
    weight: f64,
    evaluation: &Evaluation,
    prior: &Prior,
) -> Option<FitUncertainty> {
    let inverse = loose_covariance(evaluation, prior)?;
    let own = evaluate(camera, &[], &[], prior, 1.0, true)?.right;
    let size = curves.len().div_ceil(GROUPS).max(1);
    let slopes = curves.chunks(size).map(|group| {
        let weights = vec![weight; group.len()];
        let found = evaluate(camera, group, &weights, prior, 1.0, true);
        found.map(|found| found.right - own)
    });
    let slopes: Vec<_> = slopes.collect::<Option<_>>()?;
    let count = slopes.len() as f64;
    let mean = slopes.iter().sum::<Parameters>() / count;
    let scatter: Normal = slopes
        .iter()
        .map(|slope| (slope - mean) * (slope - mean).transpose())
        .sum();
    Some(deviations(camera, &(inverse * scatter * inverse)))
}

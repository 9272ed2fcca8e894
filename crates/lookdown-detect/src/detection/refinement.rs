//! The refinement of overlapping candidates by any method.

use super::{Candidate, MergedDetection, Refinement, RefinementParameters, fusion, suppression};

/// Merges the candidates of all views of one frame into detections, by descending score.
///
/// `members` of the result are indices into `candidates`. Candidates with a field out of range are
/// ignored (see [`Candidate`]). The result is finite and in range for any input.
pub fn refine(candidates: &[Candidate], parameters: &RefinementParameters) -> Vec<MergedDetection> {
    let RefinementParameters {
        iou_threshold,
        sigma,
        ..
    } = *parameters;
    match parameters.refinement {
        Refinement::Nms => suppression::suppress(
            candidates,
            parameters,
            iou_threshold,
            suppression::hard(iou_threshold),
        ),
        Refinement::SoftNmsLinear => suppression::suppress(
            candidates,
            parameters,
            iou_threshold,
            suppression::linear(iou_threshold),
        ),
        Refinement::SoftNmsGaussian => {
            suppression::suppress(candidates, parameters, 0.0, suppression::gaussian(sigma))
        }
        Refinement::Fusion => fusion::fuse(candidates, parameters),
    }
}

//! Which way overlapping candidates become persons, and with which numbers.

use strum::{Display, EnumString, IntoStaticStr, VariantArray};

use super::{Candidate, MergedDetection, fusion, suppression};

/// How overlapping candidates are refined into one detection per person.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Hash,
    Display,
    EnumString,
    IntoStaticStr,
    VariantArray,
    strum::VariantNames,
)]
#[strum(serialize_all = "snake_case")]
pub enum Refinement {
    /// Hard non-maximum suppression.
    Nms,
    /// Soft-NMS, scores lowered by 1 − IoU.
    SoftNmsLinear,
    /// Soft-NMS, scores lowered by exp(−IoU² / σ).
    SoftNmsGaussian,
    /// Weighted box fusion with agreement between views.
    Fusion,
}

impl Refinement {
    /// Returns the name, as in requests and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// A refinement and its numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefinementParameters {
    /// Which refinement.
    pub refinement: Refinement,
    /// `N_t`, 0 to 1: two boxes with at least this IoU are the same person. Unused by Gaussian
    /// Soft-NMS. At its ends: 0 leaves hard NMS a single box per frame (0 ≥ 0 holds for boxes
    /// apart, too) and lets linear Soft-NMS and fusion act on any overlap; 1 merges only boxes
    /// that coincide.
    pub iou_threshold: f64,
    /// σ of Gaussian Soft-NMS, above 0: the larger, the less an overlap lowers a score.
    pub sigma: f64,
    /// `C_t`, 0 to 1: detections with a lower score after rescoring are left out.
    pub score_threshold: f64,
    /// At most this many detections, the best.
    pub max_detections: usize,
}

impl RefinementParameters {
    /// Whether a rescored score is good enough. 0 never is, whatever the threshold: it says "no
    /// person".
    pub(super) fn keeps(&self, score: f64) -> bool {
        score > 0.0 && score >= self.score_threshold
    }
}

/// Merges the candidates of all views of one frame into detections, by descending score.
///
/// `members` of the result index into `candidates`. Candidates out of their ranges are ignored (see
/// [`Candidate`]); whatever they are, the result is finite and in range.
#[must_use]
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

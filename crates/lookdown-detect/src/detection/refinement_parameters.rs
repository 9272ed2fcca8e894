//! The refinement methods and their parameters.

use strum::{Display, EnumString, IntoStaticStr, VariantArray};

/// The method that merges overlapping candidates into one detection per person.
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
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// A refinement and its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefinementParameters {
    /// Refinement method.
    pub refinement: Refinement,
    /// `N_t`, 0 to 1: two boxes with at least this IoU are the same person. Gaussian Soft-NMS does
    /// not use it. At 0, hard NMS leaves a single box per frame (0 ≥ 0 also holds for disjoint
    /// boxes), and linear Soft-NMS and fusion act on any overlap. At 1, only boxes that coincide
    /// are merged.
    pub iou_threshold: f64,
    /// σ of Gaussian Soft-NMS, above 0. A larger σ lowers scores less for the same overlap.
    pub sigma: f64,
    /// `C_t`, 0 to 1: detections with a lower score after rescoring are removed.
    pub score_threshold: f64,
    /// Largest number of detections. The best are kept.
    pub max_detections: usize,
}

impl RefinementParameters {
    /// Returns true if a rescored score reaches the threshold. 0 never does, since it means "no
    /// person".
    pub(super) fn keeps(&self, score: f64) -> bool {
        score > 0.0 && score >= self.score_threshold
    }
}

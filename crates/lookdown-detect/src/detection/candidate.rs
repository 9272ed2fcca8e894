//! Input and output of the merge.

use super::{BBox, FramePixels};

/// A person hypothesis of one view, mapped to the frame.
///
/// Every refinement ignores a candidate with a field outside its range, for example a NaN score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Box in the frame.
    pub bbox: BBox<FramePixels>,
    /// Confidence of the detector, above 0, at most 1. A score of 0 means "no person".
    pub score: f64,
    /// Index of the view in the plan.
    pub view: usize,
    /// Weight of the coordinates relative to other candidates, above 0, at most 1. Less than 1 when
    /// the border of the view cuts the box off.
    pub coordinate_weight: f64,
    /// Number of views of the plan in which a box at this position should be detected, at least 1.
    /// With 1, [`Refinement::Fusion`](super::Refinement::Fusion) requires no agreement between
    /// views.
    pub expected_views: f64,
}

impl Candidate {
    /// Returns true if all fields are within their ranges.
    pub(super) fn is_usable(&self) -> bool {
        let share = |value: f64| value > 0.0 && value <= 1.0;
        share(self.score)
            && share(self.coordinate_weight)
            && self.expected_views >= 1.0
            && self.expected_views.is_finite()
    }
}

/// A person after merging.
#[derive(Debug, Clone, PartialEq)]
pub struct MergedDetection {
    /// Box in the frame.
    pub bbox: BBox<FramePixels>,
    /// Confidence after rescoring, above 0, at most 1.
    pub score: f64,
    /// Indices of the merged candidates in the merge's input, by descending score. One index for
    /// the NMS family, which selects boxes, and a cluster for fusion, which averages them.
    pub members: Vec<usize>,
}

//! What goes into the merge, and what comes out.

use super::{BBox, FramePixels};

/// A person hypothesis of one view, mapped to the frame.
///
/// Candidates with a field outside its range (a NaN score, say) are ignored by every refinement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Where, in the frame.
    pub bbox: BBox<FramePixels>,
    /// The detector's confidence, above 0, at most 1. A score of 0 says "no person".
    pub score: f64,
    /// Which view of the plan saw it.
    pub view: usize,
    /// How far the coordinates are to be trusted compared with other candidates, above 0, at most
    /// 1: less than 1 when the view's border cut the box off.
    pub coordinate_weight: f64,
    /// In how many views of the plan a box there should have been seen, at least 1. With 1,
    /// [`Refinement::Fusion`](super::Refinement::Fusion) asks for no agreement between views.
    pub expected_views: f64,
}

impl Candidate {
    /// Whether all fields are within their ranges.
    pub(super) fn is_usable(&self) -> bool {
        let share = |value: f64| value > 0.0 && value <= 1.0;
        share(self.score)
            && share(self.coordinate_weight)
            && self.expected_views >= 1.0
            && self.expected_views.is_finite()
    }
}

/// A person, as the merge understands the candidates.
#[derive(Debug, Clone, PartialEq)]
pub struct MergedDetection {
    /// Where, in the frame.
    pub bbox: BBox<FramePixels>,
    /// Confidence after rescoring, above 0, at most 1.
    pub score: f64,
    /// The candidates the box was made of, as indices into the merge's input, by descending
    /// score. One for the NMS family, which picks boxes; a cluster for fusion, which averages.
    pub members: Vec<usize>,
}

//! What is to be compared: the truth of an image, and what was found in it.

/// The boxes of one image, by hand or by construction.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundTruth<B> {
    /// Persons to be found.
    pub persons: Vec<B>,
    /// Regions in which a detection is neither right nor wrong (`iscrowd` in COCO files).
    pub ignore_regions: Vec<B>,
}

/// A detection with its confidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoredBox<B> {
    /// Where.
    pub bbox: B,
    /// Confidence, finite.
    pub score: f64,
}

/// One image's truth and detections.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluatedImage<B> {
    /// What is in it.
    pub truth: GroundTruth<B>,
    /// What was found, in any order; of equal scores the earlier goes first.
    pub detections: Vec<ScoredBox<B>>,
}

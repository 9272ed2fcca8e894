//! Errors of data sets.

use crate::Scoring;

/// Ground truth of one shape cannot be scored as another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "this data set has {truth} and cannot be scored by {wanted}; only rotated boxes can be made \
     axis-parallel"
)]
pub struct ScoringMismatch {
    /// The shape of the ground truth.
    pub truth: Scoring,
    /// The requested shape.
    pub wanted: Scoring,
}

impl std::fmt::Display for Scoring {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::AxisParallel => "axis-parallel boxes",
            Self::Rotated => "rotated boxes",
            Self::HeadPoint => "head points",
        })
    }
}

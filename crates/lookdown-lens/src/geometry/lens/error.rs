//! Reasons for which a lens cannot be used.

/// A lens that cannot be used. The message is one sentence with the parameter, its value and what
/// is needed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{problem}")]
pub struct LensError {
    problem: String,
    /// The largest `max_theta`, radians, if that is what is wrong.
    pub limit: Option<f64>,
}

impl LensError {
    pub(super) fn new(problem: impl Into<String>) -> Self {
        Self {
            problem: problem.into(),
            limit: None,
        }
    }

    /// Creates the error of a `max_theta` beyond this limit.
    pub(super) fn beyond(limit: f64, problem: String) -> Self {
        Self {
            problem,
            limit: Some(limit),
        }
    }
}

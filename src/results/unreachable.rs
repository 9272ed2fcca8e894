//! The error of a result store that does not answer.

/// The result store does not answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the result store does not answer: {0}")]
pub struct Unreachable(pub String);

//! The response to connections beyond the limit.

use super::problem::{Problem, ProblemKind};

/// Refuses every request.
pub(in crate::api) async fn refuse() -> Problem {
    let detail = "too many connections are open: close those that are not needed, or retry";
    Problem::new(ProblemKind::TooManyConnections, detail)
}

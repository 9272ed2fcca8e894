//! What a connection beyond the limit is told.

use super::problem::{Problem, ProblemKind};

/// Refuses whatever is asked.
pub(super) async fn refuse() -> Problem {
    let detail = "too many connections are open: close those that are not needed, or try again";
    Problem::new(ProblemKind::TooManyConnections, detail)
}

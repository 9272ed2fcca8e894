//! What a connection beyond the limit is told.

use std::time::Duration;

use axum::extract::{Request, State};
use tokio::time::timeout;

use super::{
    ApiState,
    problem::{Problem, ProblemKind},
    upload::BodyReader,
};

/// How long a refused client may go on sending, so that it comes to read the refusal.
const PATIENCE: Duration = Duration::from_secs(5);

/// Refuses whatever is asked.
pub(super) async fn refuse(State(state): State<ApiState>, request: Request) -> Problem {
    let (parts, body) = request.into_parts();
    let reader = BodyReader {
        max_bytes: state.options.max_body_bytes,
        remedy: "send less",
        budget: &state.uploads,
    };
    // Refused either way.
    let _ = timeout(PATIENCE, reader.discard_unread(&parts.headers, body)).await;
    let detail = "too many connections are open: close those that are not needed, or try again";
    Problem::new(ProblemKind::TooManyConnections, detail)
}

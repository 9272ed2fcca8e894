//! The memory of responses that clients have not read yet. A client may read as slowly as the
//! timeouts of its connection permit, and hold a large image in memory for that time. So large
//! responses take a share of a budget until their last byte is sent.

use axum::{
    body::{Body, HttpBody, to_bytes},
    extract::{Request, State},
    middleware::Next,
    response::Response,
};
use lookdown_detect::fairness::{BudgetError, Client};

use super::{
    ApiState,
    http::{
        access::Caller,
        context::RequestContext,
        problem::{Problem, ProblemKind},
        request_body::Held,
    },
};

/// Responses of at most this size, in bytes, take no share: all connections together hold 32 MiB
/// of them at the default limit.
const SMALL: u64 = 64 << 10;

/// Makes a large response take a share of the budget, or refuses it with 429.
pub(super) async fn bound(
    State(state): State<ApiState>,
    request: Request,
    next: Next,
) -> Result<Response, Problem> {
    let context = RequestContext::from_extensions(request.extensions())?;
    let caller = &context.caller;
    let response = next.run(request).await;
    let size = response.body().size_hint().exact();
    let Some(size) = size.filter(|size| *size > SMALL) else {
        // Streams hold at most a few reports each.
        return Ok(response);
    };
    // A response larger than a share takes all of it.
    let size = usize::try_from(size).unwrap_or(usize::MAX);
    let largest = match caller.client {
        Client::Only => state.responses.total(),
        _ => state.responses.share(),
    };
    let amount = size.min(largest);
    let share = state.responses.take(&caller.client, amount);
    let share = share.map_err(|error| refusal(caller, error))?;
    let (parts, body) = response.into_parts();
    let held = to_bytes(body, size).await.map_err(Problem::internal)?;
    let held = Held::new(held, share).into_bytes();
    Ok(Response::from_parts(parts, Body::from(held)))
}

fn refusal(caller: &Caller, error: BudgetError) -> Problem {
    let remedy = "read responses faster, or ask for smaller images (width)";
    let detail = match error {
        BudgetError::Full => {
            format!("too many responses that clients have not read are in memory: {remedy}")
        }
        BudgetError::ShareUsed { share } => {
            let client = &caller.client;
            format!(
                "responses that {client} has not read use its share of the memory ({share} bytes): \
                 {remedy}"
            )
        }
    };
    Problem::new(ProblemKind::Overloaded, detail)
}

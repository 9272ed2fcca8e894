//! The memory of large responses that clients have not read yet.

use std::sync::Arc;

use axum::{
    body::{Body, HttpBody, to_bytes},
    extract::{Request, State},
    middleware::Next,
    response::Response,
};
use bytes::Bytes;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::problem::{Kind, Problem};

/// Responses of at most this size take no share.
const SMALL_BYTES: u64 = 64 << 10;
/// Bytes per permit.
const UNIT_BYTES: u64 = 1 << 10;

/// A budget in bytes. Clones share it.
#[derive(Debug, Clone)]
pub(crate) struct UnreadResponses {
    free: Arc<Semaphore>,
    units: u32,
}

impl UnreadResponses {
    pub(crate) fn new(units: u32) -> Self {
        Self {
            free: Arc::new(Semaphore::new(units as usize)),
            units,
        }
    }
}

/// Makes a large response take a share of the budget until it is read, or refuses it with 429.
pub(crate) async fn bound(
    State(budget): State<UnreadResponses>,
    request: Request,
    next: Next,
) -> Result<Response, Problem> {
    let response = next.run(request).await;
    let size = response.body().size_hint().exact();
    let Some(size) = size.filter(|size| *size > SMALL_BYTES) else {
        return Ok(response);
    };
    let units = u32::try_from(size.div_ceil(UNIT_BYTES)).unwrap_or(u32::MAX);
    let units = units.min(budget.units);
    let Ok(permit) = Arc::clone(&budget.free).try_acquire_many_owned(units) else {
        let detail = "too many responses that clients have not read are in memory: read responses \
                      faster, or ask for less";
        return Err(Problem::new(Kind::Overloaded, detail));
    };
    let (parts, body) = response.into_parts();
    let content = to_bytes(body, usize::MAX).await.map_err(|error| {
        tracing::error!("a response cannot be written: {error}");
        Problem::internal()
    })?;
    let held = Held {
        content,
        _permit: permit,
    };
    Ok(Response::from_parts(
        parts,
        Body::from(Bytes::from_owner(held)),
    ))
}

/// Bytes with their share of the budget.
struct Held {
    content: Bytes,
    _permit: OwnedSemaphorePermit,
}

impl AsRef<[u8]> for Held {
    fn as_ref(&self) -> &[u8] {
        &self.content
    }
}

#[cfg(test)]
mod tests {
    use axum::{Router, http::StatusCode, middleware::from_fn_with_state, routing::get};
    use tower::ServiceExt as _;

    use super::*;

    #[tokio::test]
    async fn large_responses_share_a_budget_until_they_are_read() {
        let large = async || vec![0_u8; 100 << 10];
        let budget = UnreadResponses::new(250);
        let routes = Router::new()
            .route("/large", get(large))
            .route("/small", get(async || "small"))
            .layer(from_fn_with_state(budget, bound));
        let ask = async |path: &str| {
            let request = Request::get(path).body(Body::empty()).unwrap();
            routes.clone().oneshot(request).await.unwrap()
        };
        let (first, second) = (ask("/large").await, ask("/large").await);
        assert_eq!(
            [first.status(), second.status()],
            [StatusCode::OK, StatusCode::OK]
        );
        assert_eq!(ask("/large").await.status(), StatusCode::TOO_MANY_REQUESTS);
        assert_eq!(ask("/small").await.status(), StatusCode::OK);
        let read = to_bytes(first.into_body(), usize::MAX).await.unwrap();
        assert_eq!(read.len(), 100 << 10);
        drop(read);
        assert_eq!(ask("/large").await.status(), StatusCode::OK);
    }
}

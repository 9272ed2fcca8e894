//! Draining of unread request bodies. Many HTTP/1 clients read the response only after they have
//! sent the whole body, and lose it if the connection closes before that. So the unread body of a
//! refused request is read and discarded, within limits.

use std::{
    num::NonZeroU64,
    pin::Pin,
    task::{Context, Poll},
};

use axum::{
    body::{Body, HttpBody},
    extract::{Request, State},
    http::{
        HeaderValue, StatusCode,
        header::{CONNECTION, EXPECT},
    },
    middleware::Next,
    response::Response,
};
use bytes::Bytes;
use http_body::{Frame, SizeHint};
use tokio::{sync::oneshot, time::timeout_at};

use super::{
    context::RequestContext,
    deadline::Deadline,
    problem::Problem,
    request_body::{MinimumUploadRate, next_chunk},
};

/// Largest number of discarded bytes, as a multiple of the body limit.
const DISCARDED_LIMITS: usize = 4;

/// The limits of request bodies.
#[derive(Debug, Clone, Copy)]
pub(in crate::api) struct BodyLimits {
    /// Largest request body, bytes.
    pub(in crate::api) max_body_bytes: usize,
    /// Least upload rate; `None` for no limit.
    pub(in crate::api) min_upload_bytes_per_second: Option<NonZeroU64>,
}

/// Drains the body that the handler left unread.
pub(in crate::api) async fn discard(
    State(limits): State<BodyLimits>,
    request: Request,
    next: Next,
) -> Result<Response, Problem> {
    let (parts, body) = request.into_parts();
    let deadline = RequestContext::from_extensions(&parts.extensions)?.deadline;
    if body.is_end_stream() {
        return Ok(next.run(Request::from_parts(parts, body)).await);
    }
    // A client with `Expect: 100-continue` sends nothing until the server starts to read.
    let asks_first = parts.headers.contains_key(EXPECT);
    let (lent, mut returned) = LentBody::new(body);
    let mut response = next.run(Request::from_parts(parts, Body::new(lent))).await;
    let status = response.status();
    if status == StatusCode::REQUEST_TIMEOUT {
        // The rest of the body would be parsed as another request.
        let close = HeaderValue::from_static("close");
        response.headers_mut().insert(CONNECTION, close);
    } else if (status.is_client_error() || status.is_server_error())
        && let Ok(body) = returned.try_recv()
        && (body.begun || !asks_first)
    {
        let upload_rate = MinimumUploadRate::begin(limits.min_upload_bytes_per_second);
        let most = limits.max_body_bytes.saturating_mul(DISCARDED_LIMITS);
        throw_away(body.body, most, upload_rate, deadline).await;
    }
    Ok(response)
}

async fn throw_away(
    mut body: Body,
    most: usize,
    mut upload_rate: MinimumUploadRate,
    deadline: Deadline,
) {
    let mut left = most;
    while !body.is_end_stream()
        && let Ok(Ok(Some(chunk))) =
            timeout_at(upload_rate.late_at(deadline.at()), next_chunk(&mut body)).await
        && chunk.len() < left
    {
        left -= chunk.len();
        upload_rate.came(chunk.len());
    }
}

/// A body that is returned when its reader drops it.
struct LentBody {
    returned: Option<ReturnedBody>,
    back: Option<oneshot::Sender<ReturnedBody>>,
}

struct ReturnedBody {
    body: Body,
    /// `true` if the reader has polled the body.
    begun: bool,
}

impl LentBody {
    fn new(body: Body) -> (Self, oneshot::Receiver<ReturnedBody>) {
        let (back, returned) = oneshot::channel();
        let body = ReturnedBody { body, begun: false };
        let lent = Self {
            returned: Some(body),
            back: Some(back),
        };
        (lent, returned)
    }
}

impl Drop for LentBody {
    fn drop(&mut self) {
        if let (Some(body), Some(back)) = (self.returned.take(), self.back.take()) {
            // The receiver is gone if the request was abandoned.
            let _ = back.send(body);
        }
    }
}

impl HttpBody for LentBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        match &mut self.returned {
            Some(lent) => {
                lent.begun = true;
                Pin::new(&mut lent.body).poll_frame(context)
            }
            None => Poll::Ready(None),
        }
    }

    fn is_end_stream(&self) -> bool {
        let lent = self.returned.as_ref();
        lent.is_none_or(|lent| lent.body.is_end_stream())
    }

    fn size_hint(&self) -> SizeHint {
        let lent = self.returned.as_ref();
        lent.map_or_else(SizeHint::default, |lent| lent.body.size_hint())
    }
}

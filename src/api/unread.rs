//! What a refused client still sends. In the middle of sending, many HTTP/1 clients look for an
//! answer only when they have sent everything, and lose it when the connection is closed on them. So
//! what a refused request has left unread is read and thrown away, within bounds.

use std::{
    pin::Pin,
    task::{Context, Poll},
};

use axum::{
    body::{Body, HttpBody},
    extract::{Request, State},
    http::{
        HeaderValue, StatusCode, Version,
        header::{CONNECTION, EXPECT},
    },
    middleware::Next,
    response::Response,
};
use bytes::Bytes;
use http_body::{Frame, SizeHint};
use tokio::{sync::oneshot, time::timeout_at};

use super::{
    ApiState,
    deadline::Deadline,
    upload::{Pace, next_chunk},
};

/// This many times the largest body is thrown away at most.
const DISCARDED_LIMITS: usize = 4;

/// Starts the request's time, and discards what its answer leaves unread.
pub(super) async fn discard(
    State(state): State<ApiState>,
    request: Request,
    next: Next,
) -> Response {
    let (mut parts, body) = request.into_parts();
    let deadline = Deadline::begin(state.options.request_timeout);
    parts.extensions.insert(deadline);
    if body.is_end_stream() || parts.version >= Version::HTTP_2 {
        // A stream of HTTP/2 is answered while its client sends.
        return next.run(Request::from_parts(parts, body)).await;
    }
    // Such a client has not begun to send unless somebody has begun to read.
    let asks_first = parts.headers.contains_key(EXPECT);
    let (lent, mut returned) = LentBody::new(body);
    let mut response = next.run(Request::from_parts(parts, Body::new(lent))).await;
    let status = response.status();
    if status == StatusCode::REQUEST_TIMEOUT {
        // What comes later would be taken for another request.
        let close = HeaderValue::from_static("close");
        response.headers_mut().insert(CONNECTION, close);
    } else if (status.is_client_error() || status.is_server_error())
        && let Ok(body) = returned.try_recv()
        && (body.begun || !asks_first)
    {
        let pace = Pace::begin(state.options.min_upload_bytes_per_second);
        let most = state
            .options
            .max_body_bytes
            .saturating_mul(DISCARDED_LIMITS);
        throw_away(body.body, most, pace, deadline).await;
    }
    response
}

async fn throw_away(mut body: Body, most: usize, mut pace: Pace, deadline: Deadline) {
    let mut left = most;
    while !body.is_end_stream()
        && let Ok(Ok(Some(chunk))) =
            timeout_at(pace.late_at(deadline.at()), next_chunk(&mut body)).await
        && chunk.len() < left
    {
        left -= chunk.len();
        pace.came(chunk.len());
    }
}

/// A body that comes back when whoever it is lent to has done with it.
struct LentBody {
    returned: Option<ReturnedBody>,
    back: Option<oneshot::Sender<ReturnedBody>>,
}

struct ReturnedBody {
    body: Body,
    /// Whether any of it was asked for.
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
            // Nobody wants it back when the request was given up.
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

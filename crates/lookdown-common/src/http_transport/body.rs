//! The body of a response, which has to end in time.

use std::{
    future::Future as _,
    pin::Pin,
    task::{Context, Poll},
    time::Duration,
};

use bytes::Bytes;
use http_body::{Body, Frame, SizeHint};
use hyper::body::Incoming;
use tokio::time::{Instant, Sleep, sleep_until};
use tower::BoxError;

use super::error::HttpError;

/// A body that fails at its deadline.
pub(super) struct UntilDeadline {
    body: Incoming,
    deadline: Pin<Box<Sleep>>,
    /// The time of the whole request.
    limit: Duration,
}

impl UntilDeadline {
    pub(super) fn new(body: Incoming, deadline: Instant, limit: Duration) -> Self {
        Self {
            body,
            deadline: Box::pin(sleep_until(deadline)),
            limit,
        }
    }
}

impl Body for UntilDeadline {
    type Data = Bytes;
    type Error = BoxError;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, BoxError>>> {
        if self.deadline.as_mut().poll(context).is_ready() {
            return Poll::Ready(Some(Err(HttpError::Timeout(self.limit).into())));
        }
        let frame = Pin::new(&mut self.body).poll_frame(context);
        frame.map_err(Into::into)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

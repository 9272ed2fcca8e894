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
use hyper_util::client::legacy;
use tokio::time::{Instant, Sleep, sleep_until};
use tower::BoxError;

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

/// Most provisional responses before a response.
pub(super) const MAX_PROVISIONAL: usize = 16;

/// A reason why there is no HTTP client.
#[derive(Debug, thiserror::Error)]
#[error(
    "upstream.authorities: {0}: give a PEM file with the authorities of the server's certificate"
)]
pub struct ClientError(pub(crate) String);

/// The reason why a request has no response, or its response no end.
#[derive(Debug, thiserror::Error)]
pub enum HttpError {
    /// A request that cannot be written, or a body that ends early.
    #[error(transparent)]
    Message(reqwest::Error),
    /// No connection, or one that ended.
    #[error(transparent)]
    Connection(#[from] legacy::Error),
    /// No response in time.
    #[error("there is no whole response within {0:?}")]
    Timeout(Duration),
    /// Provisional responses without end.
    #[error("more than {MAX_PROVISIONAL} provisional responses (1xx) arrived before the response")]
    Provisional,
}

impl From<reqwest::Error> for HttpError {
    fn from(error: reqwest::Error) -> Self {
        // A URL may be a secret.
        Self::Message(error.without_url())
    }
}

//! A response body that can be shared between threads.

use std::{
    pin::Pin,
    task::{Context, Poll},
};

use axum::body::Body;
use bytes::Bytes;
use http_body::{Body as HttpBody, Frame, SizeHint};
use parking_lot::Mutex;

/// A body in a mutex, which makes it `Sync`.
pub(super) struct Exclusive(pub(super) Mutex<Body>);

impl HttpBody for Exclusive {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(self.0.get_mut()).poll_frame(context)
    }

    fn size_hint(&self) -> SizeHint {
        self.0.lock().size_hint()
    }
}

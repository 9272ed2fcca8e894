//! Streams and response bodies that report their activity to the [`ConnectionTimeouts`].

use std::{
    io::{self, IoSlice},
    pin::Pin,
    sync::Arc,
    task::{Context, Poll},
};

use hyper::body::{Body, Frame, SizeHint};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use super::connection_timeouts::ConnectionTimeouts;

/// The stream of a client.
pub(super) struct InstrumentedStream<T> {
    pub(super) stream: T,
    pub(super) timeouts: Arc<ConnectionTimeouts>,
}

impl<T> InstrumentedStream<T> {
    fn record(&self, written: &Poll<io::Result<usize>>) {
        match written {
            Poll::Pending => self.timeouts.blocked(),
            Poll::Ready(bytes) => self.timeouts.sent(*bytes.as_ref().unwrap_or(&0)),
        }
    }
}

impl<T: AsyncRead + Unpin> AsyncRead for InstrumentedStream<T> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        let outcome = Pin::new(&mut self.stream).poll_read(context, buffer);
        if buffer.filled().len() > before {
            self.timeouts.received();
        }
        outcome
    }
}

impl<T: AsyncWrite + Unpin> AsyncWrite for InstrumentedStream<T> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let outcome = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.record(&outcome);
        outcome
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        parts: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let outcome = Pin::new(&mut self.stream).poll_write_vectored(context, parts);
        self.record(&outcome);
        outcome
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }
}

/// The body of a response. The request ends when this is dropped.
pub(super) struct InstrumentedBody<B> {
    pub(super) body: B,
    pub(super) timeouts: Arc<ConnectionTimeouts>,
}

impl<B: Body + Unpin> Body for InstrumentedBody<B> {
    type Data = B::Data;
    type Error = B::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<B::Data>, B::Error>>> {
        Pin::new(&mut self.body).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

impl<B> Drop for InstrumentedBody<B> {
    fn drop(&mut self) {
        self.timeouts.request_ends();
    }
}

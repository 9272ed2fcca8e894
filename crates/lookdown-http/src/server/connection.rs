//! One connection, from the first byte to the last.

use std::{
    convert::Infallible,
    io::{self, IoSlice},
    net::SocketAddr,
    pin::{Pin, pin},
    sync::Arc,
    task::{Context, Poll},
    time::Duration,
};

use hyper::{
    Request, Response,
    body::{Body, Frame, Incoming, SizeHint},
    header::{CONNECTION, HeaderValue},
    server::conn::http1,
    service::service_fn,
};
use hyper_util::rt::TokioIo;
use tokio::{
    io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadBuf},
    time::timeout,
};
use tower::{BoxError, Service, ServiceExt};

use super::{ConnectionLimits, connection_timeouts::ConnectionTimeouts};
use crate::Shutdown;

/// The connection passes heads of up to this multiple of the limit to the service, which refuses
/// them with a description.
const HEAD_LIMIT_FACTOR: usize = 2;
/// Longest wait, 500 milliseconds, for the first request on a connection that was accepted just
/// before draining.
const FIRST_REQUEST_DRAIN_TIMEOUT: Duration = Duration::from_millis(500);
/// Longest time, 1 second, for which input is discarded after a request that could not be parsed.
const DISCARD_TIMEOUT: Duration = Duration::from_secs(1);
/// Most bytes, 4 MiB, that are discarded then.
const MAX_DISCARDED_BYTES: u64 = 4 << 20;

/// The rules of a connection.
pub(super) struct Rules {
    pub(super) limits: ConnectionLimits,
    /// The address of the client, unless it has already disconnected.
    pub(super) client: Option<SocketAddr>,
    pub(super) shutdown: Shutdown,
}

/// Serves the requests of a client one after the other, until it disconnects, exceeds a timeout, or
/// the server shuts down.
pub(super) async fn serve<T, S, B>(stream: T, service: S, rules: Rules)
where
    T: AsyncRead + AsyncWrite + Unpin + Send,
    S: Service<Request<Incoming>, Response = Response<B>, Error = Infallible> + Clone,
    B: Body<Data: Send, Error: Into<BoxError>> + Unpin + 'static,
{
    let Rules {
        limits,
        client,
        shutdown,
    } = rules;
    let timeouts = Arc::new(ConnectionTimeouts::new(&limits));
    let service = service_fn(|mut request: Request<Incoming>| {
        if let Some(client) = client {
            request.extensions_mut().insert(client);
        }
        timeouts.request_begins();
        let answer = service.clone().oneshot(request);
        let (timeouts, shutdown) = (Arc::clone(&timeouts), &shutdown);
        async move {
            let mut response = answer.await?;
            if shutdown.is_requested() {
                let close = HeaderValue::from_static("close");
                response.headers_mut().insert(CONNECTION, close);
            }
            Ok::<_, Infallible>(response.map(|body| InstrumentedBody { body, timeouts }))
        }
    });
    let mut stream = InstrumentedStream {
        stream,
        timeouts: Arc::clone(&timeouts),
    };
    let connection = http1::Builder::new()
        .max_headers(limits.max_headers * HEAD_LIMIT_FACTOR)
        .max_header_size(limits.max_header_bytes * HEAD_LIMIT_FACTOR)
        .serve_connection(TokioIo::new(&mut stream), service);
    let was_refused = {
        let mut connection = pin!(connection);
        let to_its_end = async {
            tokio::select! {
                // Checked first: requests that arrived before the shutdown are served.
                biased;
                ended = connection.as_mut() => return ended,
                () = shutdown.draining() => {}
            }
            if timeouts.awaits_first_request()
                && let Ok(ended) = timeout(FIRST_REQUEST_DRAIN_TIMEOUT, connection.as_mut()).await
            {
                return ended;
            }
            connection.as_mut().graceful_shutdown();
            connection.await
        };
        tokio::select! {
            ended = to_its_end => ended.is_err_and(|error| {
                tracing::debug!("a connection failed: {error}");
                error.is_parse()
            }),
            () = timeouts.overdue() => {
                tracing::debug!("a connection exceeded a timeout and was closed");
                false
            }
        }
    };
    if was_refused {
        let _ = timeout(DISCARD_TIMEOUT, discard_rest(stream)).await;
    }
}

/// Ends a connection whose client may still be sending. An immediate close would reset the
/// connection and lose the response.
async fn discard_rest(mut stream: impl AsyncRead + AsyncWrite + Unpin) -> io::Result<()> {
    stream.shutdown().await?;
    let mut rest = stream.take(MAX_DISCARDED_BYTES);
    tokio::io::copy(&mut rest, &mut tokio::io::sink()).await?;
    Ok(())
}

/// The stream of a client.
struct InstrumentedStream<T> {
    stream: T,
    timeouts: Arc<ConnectionTimeouts>,
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
struct InstrumentedBody<B> {
    body: B,
    timeouts: Arc<ConnectionTimeouts>,
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

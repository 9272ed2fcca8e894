//! The HTTP/1.1 server: it accepts connections within limits and closes them in order. It is
//! independent of the service that answers the requests.

mod connection;
mod connection_limits;
mod connection_timeouts;

use std::{convert::Infallible, future::Future, io, net::SocketAddr, sync::Arc, time::Duration};

use hyper::{
    Request, Response,
    body::{Body, Incoming},
};
use prometheus::IntGauge;
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::{TcpListener, TcpStream},
    sync::{OwnedSemaphorePermit, Semaphore},
    task::JoinSet,
    time::{Instant, sleep},
};
use tower::{BoxError, Service};

use crate::Shutdown;

use connection::Rules;

pub use connection_limits::ConnectionLimits;

/// The handshake at the beginning of each connection.
pub trait Handshake: Send + Sync + 'static {
    /// The encrypted connection.
    type Stream: AsyncRead + AsyncWrite + Send + Unpin;

    /// Returns the connection, or `None` if the handshake fails or takes too long.
    fn accept(&self, connection: TcpStream) -> impl Future<Output = Option<Self::Stream>> + Send;
}

/// Connections without a handshake.
#[derive(Debug, Clone, Copy)]
pub enum Plain {}

impl Handshake for Plain {
    type Stream = TcpStream;

    async fn accept(&self, connection: TcpStream) -> Option<TcpStream> {
        Some(connection)
    }
}

/// Listens on an address. `setting` names it in the error.
///
/// # Errors
/// One sentence, for an address that is in use or not one of this machine.
pub async fn bind(setting: &str, address: SocketAddr) -> Result<TcpListener, String> {
    TcpListener::bind(address).await.map_err(|error| {
        format!("{setting}: {address} cannot be used: {error}: give a free address of this machine")
    })
}

/// An open connection: it counts as one until this is dropped, and holds a permit until then.
struct OpenConnection {
    _permit: Option<OwnedSemaphorePermit>,
    open: IntGauge,
}

impl OpenConnection {
    fn new(permit: Option<OwnedSemaphorePermit>, open: &IntGauge) -> Self {
        open.inc();
        Self {
            _permit: permit,
            open: open.clone(),
        }
    }
}

impl Drop for OpenConnection {
    fn drop(&mut self) {
        self.open.dec();
    }
}

/// Serves until `shutdown` reaches draining. Then connections in the backlog are accepted, idle
/// ones are closed, and those with a request in flight are closed after its response. The function
/// returns when none is left. Dropping it closes all connections at once. With `tls`, every
/// connection begins with a handshake. Each request carries the address of its client, a
/// [`SocketAddr`], among its extensions. `open` counts the open connections.
pub async fn serve<H, S, B>(
    listener: TcpListener,
    tls: Option<&Arc<H>>,
    service: S,
    limits: &ConnectionLimits,
    open: &IntGauge,
    shutdown: &Shutdown,
) where
    H: Handshake,
    S: Service<Request<Incoming>, Response = Response<B>, Error = Infallible>,
    S: Clone + Send + Sync + 'static,
    S::Future: Send,
    B: Body<Data: Send, Error: Into<BoxError>> + Send + Unpin + 'static,
{
    let mut acceptor = Acceptor::new(listener);
    let permits = Arc::new(Semaphore::new(limits.max_connections.get()));
    let mut connections = JoinSet::new();
    let serve_on = |stream: TcpStream, permit: Option<OwnedSemaphorePermit>| {
        let connection = OpenConnection::new(permit, open);
        let rules = Rules {
            limits: limits.clone(),
            client: stream.peer_addr().ok(),
            shutdown: shutdown.clone(),
        };
        let (service, tls) = (service.clone(), tls.cloned());
        async move {
            let _connection = connection;
            match tls {
                None => connection::serve(stream, service, rules).await,
                Some(tls) => {
                    if let Some(stream) = tls.accept(stream).await {
                        connection::serve(stream, service, rules).await;
                    }
                }
            }
        }
    };
    loop {
        // Connections beyond the limit wait in the backlog of the listener.
        let next = async {
            let permit = Arc::clone(&permits).acquire_owned().await.ok();
            (acceptor.accept().await, permit)
        };
        let (stream, permit) = tokio::select! {
            () = shutdown.draining() => break,
            Some(_ended) = connections.join_next() => continue,
            next = next => next,
        };
        connections.spawn(serve_on(stream, permit));
    }
    for stream in acceptor.close() {
        connections.spawn(serve_on(stream, None));
    }
    while connections.join_next().await.is_some() {}
}

/// Pause after the system has refused a connection.
const PAUSE: Duration = Duration::from_millis(100);
/// Refusals that are less than this apart belong to one outage.
const OUTAGE: Duration = Duration::from_mins(1);

/// Accepts connections.
struct Acceptor {
    listener: TcpListener,
    outage: Outage,
}

impl Acceptor {
    fn new(listener: TcpListener) -> Self {
        Self {
            listener,
            outage: Outage::default(),
        }
    }

    /// Returns the next connection. When the system refuses one, for example for lack of file
    /// descriptors, it retries after a pause.
    async fn accept(&mut self) -> TcpStream {
        loop {
            match self.listener.accept().await {
                Ok((stream, _)) => return without_delay(stream),
                Err(error) if is_of_one_connection(&error) => {}
                Err(error) => {
                    if self.outage.begins(Instant::now()) {
                        tracing::error!(
                            "connections cannot be accepted ({error}): retrying; if there are too \
                             few file descriptors, raise their limit or lower \
                             server.max_connections"
                        );
                    }
                    sleep(PAUSE).await;
                }
            }
        }
    }

    /// Closes the listener and returns the connections of its backlog.
    fn close(self) -> Vec<TcpStream> {
        // Uses the socket directly: tokio may not have registered the last connections yet.
        let Ok(listener) = self.listener.into_std() else {
            return Vec::new();
        };
        let waiting = std::iter::from_fn(|| listener.accept().ok());
        let streams = waiting.filter_map(|(stream, _)| {
            stream.set_nonblocking(true).ok()?;
            TcpStream::from_std(stream).ok()
        });
        streams.map(without_delay).collect()
    }
}

/// Disables Nagle's algorithm. Otherwise responses wait for the acknowledgement of earlier ones.
fn without_delay(stream: TcpStream) -> TcpStream {
    // A connection that is already closed is detected when it is read.
    let _ = stream.set_nodelay(true);
    stream
}

/// Returns true if the error concerns only the connection that was about to be accepted.
fn is_of_one_connection(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::ConnectionAborted
            | io::ErrorKind::ConnectionReset
            | io::ErrorKind::ConnectionRefused
    )
}

/// Distinguishes the first refusal of an outage from those that follow.
#[derive(Debug, Default)]
struct Outage {
    last: Option<Instant>,
}

impl Outage {
    /// Records a refusal. Returns true if an outage begins with it.
    fn begins(&mut self, now: Instant) -> bool {
        let last = self.last.replace(now);
        last.is_none_or(|last| now.duration_since(last) > OUTAGE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outage_is_reported_once() {
        let mut outage = Outage::default();
        let start = Instant::now();
        let reported = (0..1000).filter(|tenth| outage.begins(start + PAUSE * *tenth));
        assert_eq!(reported.count(), 1);
        let later = start + PAUSE * 1000 + OUTAGE;
        assert!(outage.begins(later));
        assert!(!outage.begins(later + OUTAGE));
    }
}

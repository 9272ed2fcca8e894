//! The HTTP/1.1 server: it accepts connections within limits and closes them in order. It is
//! independent of the service that answers the requests.

mod accept;
mod connection;
mod connection_limits;
mod connection_timeouts;
mod instrumented_io;

use std::{convert::Infallible, future::Future, net::SocketAddr, sync::Arc};

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
};
use tower::{BoxError, Service};

pub use self::connection_limits::ConnectionLimits;
use self::{accept::Acceptor, connection::Rules};
use crate::Shutdown;

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

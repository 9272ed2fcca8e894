//! The HTTP/1.1 server: it accepts connections within limits and closes them in order. It is
//! independent of the service that answers the requests.

mod accept;
mod connection;
mod connection_limits;
mod connection_permits;
mod connection_timeouts;
mod instrumented_io;

use std::{convert::Infallible, future::Future, net::SocketAddr, sync::Arc, time::Duration};

use hyper::{
    Request, Response,
    body::{Body, Incoming},
};
use prometheus::IntGauge;
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::{TcpListener, TcpStream},
    task::JoinSet,
};
use tower::{BoxError, Service};

pub use self::connection_limits::ConnectionLimits;
use self::{
    accept::Acceptor,
    connection::Rules,
    connection_permits::{ConnectionPermit, ConnectionPermits},
};
use crate::Shutdown;

/// Longest time for the handshake, and for the head, on a connection beyond the limit. A probe
/// needs milliseconds of CPU time, which it may wait for beside a flood of handshakes.
const TIMEOUT_BEYOND_LIMIT: Duration = Duration::from_secs(2);

/// The services that answer. Each request carries the address of its client, a
/// [`SocketAddr`], among its extensions.
#[derive(Debug, Clone)]
pub struct Services<S> {
    /// The service for connections within the limit.
    pub regular: S,
    /// The service for the single request of a connection beyond the limit.
    pub beyond_limit: S,
}

/// The handshake at the beginning of each connection.
pub trait Handshake: Send + Sync + 'static {
    /// The encrypted connection.
    type Stream: AsyncRead + AsyncWrite + Send + Unpin;

    /// Returns the connection, or `None` if the handshake fails or takes longer than
    /// `max_duration`.
    fn accept(
        &self,
        connection: TcpStream,
        max_duration: Duration,
    ) -> impl Future<Output = Option<Self::Stream>> + Send;
}

/// Connections without a handshake.
#[derive(Debug, Clone, Copy)]
pub enum Plain {}

impl Handshake for Plain {
    type Stream = TcpStream;

    async fn accept(&self, connection: TcpStream, _: Duration) -> Option<TcpStream> {
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

/// Serves until `shutdown` reaches draining. Then connections in the backlog are accepted, idle
/// ones are closed, and those with a request in flight are closed after its response. The function
/// returns when none is left. Dropping it closes all connections at once. With `tls`, every
/// connection begins with a handshake.
/// `open` counts the open connections.
pub async fn serve<H, S, B>(
    listener: TcpListener,
    tls: Option<&Arc<H>>,
    services: Services<S>,
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
    let permits = ConnectionPermits::new(limits.max_connections, open);
    let mut connections = JoinSet::new();
    let serve_on = |stream: TcpStream, permit: ConnectionPermit| {
        let is_regular = permit.is_regular();
        let (service, max_duration) = if is_regular {
            (services.regular.clone(), Duration::MAX)
        } else {
            (services.beyond_limit.clone(), TIMEOUT_BEYOND_LIMIT)
        };
        let rules = Rules {
            limits: ConnectionLimits {
                header_timeout: limits.header_timeout.min(max_duration),
                ..limits.clone()
            },
            one_request_only: !is_regular,
            client: stream.peer_addr().ok(),
            shutdown: shutdown.clone(),
        };
        let tls = tls.cloned();
        async move {
            let served = async {
                match tls {
                    None => connection::serve(stream, service, rules).await,
                    Some(tls) => {
                        if let Some(stream) = tls.accept(stream, max_duration).await {
                            connection::serve(stream, service, rules).await;
                        }
                    }
                }
            };
            tokio::select! {
                () = served => {}
                () = permit.closed.cancelled() => {}
            }
        }
    };
    loop {
        let stream = tokio::select! {
            () = shutdown.draining() => break,
            Some(_ended) = connections.join_next() => continue,
            stream = acceptor.accept() => stream,
        };
        connections.spawn(serve_on(stream, permits.take()));
    }
    for stream in acceptor.close() {
        connections.spawn(serve_on(stream, permits.take()));
    }
    while connections.join_next().await.is_some() {}
}

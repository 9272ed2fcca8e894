//! Sockets: connections are accepted within limits, served over HTTP/1.1 and brought to an end in
//! order. Knows nothing of what is asked and answered on them.

mod accept;
mod connection;
mod connection_permits;
mod pace;
mod watched;

use std::{convert::Infallible, num::NonZeroUsize, sync::Arc, time::Duration};

use hyper::{
    Request, Response,
    body::{Body, Incoming},
};
use tokio::{
    net::{TcpListener, TcpStream},
    task::JoinSet,
    time::timeout,
};
use tower::{BoxError, Service};

use self::{
    accept::Acceptor,
    connection::Rules,
    connection_permits::{ConnectionPermit, ConnectionPermits},
};
use crate::{metrics::Metrics, shutdown::Shutdown, tls::Tls};

/// Longest that the handshake and the head of a connection beyond the limit may take. A probe needs
/// milliseconds.
const HEADER_TIMEOUT_BEYOND_LIMIT: Duration = Duration::from_millis(500);

/// What connections may cost.
#[derive(Debug, Clone, PartialEq)]
pub struct ConnectionLimits {
    /// Most connections that are served at the same time.
    pub max_connections: NonZeroUsize,
    /// Longest that the head of a request may take: on a new connection from the start, on one
    /// that has served requests from the head's first byte.
    pub header_timeout: Duration,
    /// Longest that a connection may stand still between two requests, or because its client does
    /// not take what it is sent.
    pub idle_timeout: Duration,
    /// Most bytes of a request's head. More than this is the service's to refuse; a head of more
    /// than twice as many never reaches it.
    pub max_header_bytes: usize,
    /// Most headers of a request, in the same way.
    pub max_headers: usize,
}

impl Default for ConnectionLimits {
    fn default() -> Self {
        Self {
            max_connections: NonZeroUsize::new(512).unwrap_or(NonZeroUsize::MIN),
            header_timeout: Duration::from_secs(10),
            idle_timeout: Duration::from_secs(75),
            max_header_bytes: 16 * 1024,
            max_headers: 100,
        }
    }
}

/// What answers. Each request carries the address of its client, a [`std::net::SocketAddr`], among its
/// extensions.
#[derive(Debug, Clone)]
pub struct Services<S> {
    /// What answers within the limit of connections.
    pub regular: S,
    /// What answers the one request of a connection beyond it.
    pub beyond_limit: S,
}

/// Serves until `shutdown` has come to draining. Then what has connected by then is accepted, idle
/// connections are closed, and those with a request in flight when it is answered; when none is
/// left, this ends. Dropped, it closes all of them at once. With `tls`, every connection begins with
/// a handshake.
pub async fn serve<S, B>(
    listener: TcpListener,
    tls: Option<&Arc<Tls>>,
    services: Services<S>,
    limits: &ConnectionLimits,
    metrics: &Arc<Metrics>,
    shutdown: &Shutdown,
) where
    S: Service<Request<Incoming>, Response = Response<B>, Error = Infallible>,
    S: Clone + Send + Sync + 'static,
    S::Future: Send,
    B: Body<Data: Send, Error: Into<BoxError>> + Send + Unpin + 'static,
{
    let mut acceptor = Acceptor::new(listener);
    let permits = ConnectionPermits::new(limits.max_connections, metrics);
    let mut connections = JoinSet::new();
    let serve_on = |stream: TcpStream, permit: ConnectionPermit| {
        let is_regular = permit.is_regular();
        let (service, header_timeout) = if is_regular {
            (services.regular.clone(), limits.header_timeout)
        } else {
            let timeout = limits.header_timeout.min(HEADER_TIMEOUT_BEYOND_LIMIT);
            (services.beyond_limit.clone(), timeout)
        };
        let rules = Rules {
            limits: ConnectionLimits {
                header_timeout,
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
                        let handshake = tls.accept(stream);
                        let stream = if is_regular {
                            handshake.await
                        } else {
                            let within = HEADER_TIMEOUT_BEYOND_LIMIT;
                            timeout(within, handshake).await.ok().flatten()
                        };
                        if let Some(stream) = stream {
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

//! The HTTP/1.1 server: it accepts connections within limits and closes them in order. It is
//! independent of the service that answers the requests.

mod accept;
mod connection;
mod connection_limits;
mod connection_permits;
mod connection_timeouts;
mod instrumented_io;

use std::{convert::Infallible, sync::Arc, time::Duration};

use hyper::{
    Request, Response,
    body::{Body, Incoming},
};
use tokio::{
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
use crate::{metrics::Metrics, shutdown::Shutdown, tls::Tls};

/// Longest time for the handshake, and for the head, on a connection beyond the limit. A probe
/// needs milliseconds.
const TIMEOUT_BEYOND_LIMIT: Duration = Duration::from_millis(500);

/// The services that answer. Each request carries the address of its client, a [`std::net::SocketAddr`], among its
/// extensions.
#[derive(Debug, Clone)]
pub struct Services<S> {
    /// The service for connections within the limit.
    pub regular: S,
    /// The service for the single request of a connection beyond the limit.
    pub beyond_limit: S,
}

/// Serves until `shutdown` reaches draining. Then connections in the backlog are accepted, idle
/// ones are closed, and those with a request in flight are closed after its response. The function
/// returns when none is left. Dropping it closes all connections at once. With `tls`, every
/// connection begins with a handshake.
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

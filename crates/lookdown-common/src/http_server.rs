//! An HTTP server with limits on connections and their time.

use std::{convert::Infallible, net::SocketAddr, sync::Arc, time::Duration};

use hyper::{
    Request, Response,
    body::{Body, Incoming},
    server::conn::http1,
    service::Service,
};
use hyper_util::rt::TokioIo;
use tokio::{
    net::TcpListener,
    sync::Semaphore,
    time::{sleep, timeout},
};

/// Most connections at a time.
const MAX_CONNECTIONS: usize = 32;
/// Longest time of a connection.
const CONNECTION_TIMEOUT: Duration = Duration::from_secs(30);
/// Pause after a failure to accept a connection.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Listens on an address. `setting` names it in the error.
///
/// # Errors
/// If the address cannot be used.
pub async fn bind(setting: &str, address: SocketAddr) -> Result<TcpListener, String> {
    TcpListener::bind(address).await.map_err(|error| {
        format!("{setting}: {address} cannot be used: {error}: give a free address of this machine")
    })
}

/// Serves requests, one per connection. Never ends.
pub async fn serve<S, B>(listener: TcpListener, service: S)
where
    S: Service<Request<Incoming>, Response = Response<B>, Error = Infallible>
        + Clone
        + Send
        + 'static,
    S::Future: Send,
    B: Body + Send + 'static,
    B::Data: Send,
    B::Error: Into<Box<dyn std::error::Error + Send + Sync>>,
{
    let permits = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    loop {
        let Ok(permit) = Arc::clone(&permits).acquire_owned().await else {
            return;
        };
        let Ok((connection, _)) = listener.accept().await else {
            sleep(ACCEPT_PAUSE).await;
            continue;
        };
        let service = service.clone();
        tokio::spawn(async move {
            let exchange = http1::Builder::new()
                .keep_alive(false)
                .serve_connection(TokioIo::new(connection), service);
            // A failed connection concerns its client only.
            let _ = timeout(CONNECTION_TIMEOUT, exchange).await;
            drop(permit);
        });
    }
}

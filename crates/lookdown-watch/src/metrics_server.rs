//! The HTTP server of the metrics.

use std::{convert::Infallible, net::SocketAddr, sync::Arc, time::Duration};

use bytes::Bytes;
use http_body_util::Full;
use hyper::{
    Method, Request, Response, StatusCode,
    body::Incoming,
    header::{ALLOW, CONTENT_TYPE},
    server::conn::http1,
    service::service_fn,
};
use hyper_util::rt::TokioIo;
use tokio::{
    net::{TcpListener, TcpStream},
    sync::Semaphore,
    time::{sleep, timeout},
};

use crate::Metrics;

/// Most connections at a time.
const MAX_CONNECTIONS: usize = 16;
/// Longest time of a connection.
const CONNECTION_TIMEOUT: Duration = Duration::from_secs(10);
/// Pause after a failure to accept a connection.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Listens on an address.
///
/// # Errors
/// If the address cannot be used.
pub(crate) async fn bind(address: SocketAddr) -> Result<TcpListener, String> {
    TcpListener::bind(address).await.map_err(|error| {
        format!("--metrics-listen: {address} cannot be used: {error}: give a free address of this machine")
    })
}

/// Serves the metrics. Never ends.
pub(crate) async fn serve(listener: TcpListener, metrics: Arc<Metrics>) {
    let permits = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    loop {
        let Ok(permit) = Arc::clone(&permits).acquire_owned().await else {
            return;
        };
        let Ok((connection, _)) = listener.accept().await else {
            sleep(ACCEPT_PAUSE).await;
            continue;
        };
        let metrics = Arc::clone(&metrics);
        tokio::spawn(async move {
            // A failed connection concerns its client only.
            let _ = timeout(CONNECTION_TIMEOUT, answer(connection, metrics)).await;
            drop(permit);
        });
    }
}

async fn answer(connection: TcpStream, metrics: Arc<Metrics>) -> hyper::Result<()> {
    let service = service_fn(|request: Request<Incoming>| {
        let response = response(&request, &metrics);
        async move { Ok::<_, Infallible>(response) }
    });
    http1::Builder::new()
        .keep_alive(false)
        .serve_connection(TokioIo::new(connection), service)
        .await
}

fn response<B>(request: &Request<B>, metrics: &Metrics) -> Response<Full<Bytes>> {
    let is_read = [Method::GET, Method::HEAD].contains(request.method());
    let (status, header, body) = match request.uri().path() {
        "/metrics" if is_read => {
            let kind = (CONTENT_TYPE, "text/plain; version=0.0.4");
            (StatusCode::OK, kind, metrics.text())
        }
        "/metrics" => {
            let allowed = (ALLOW, "GET, HEAD");
            (StatusCode::METHOD_NOT_ALLOWED, allowed, Vec::new())
        }
        _ => {
            let text = b"the metrics are at /metrics\n".to_vec();
            (StatusCode::NOT_FOUND, (CONTENT_TYPE, "text/plain"), text)
        }
    };
    let mut response = Response::new(Full::new(body.into()));
    *response.status_mut() = status;
    let (name, value) = header;
    response
        .headers_mut()
        .insert(name, hyper::header::HeaderValue::from_static(value));
    response
}

//! The HTTP server of the metrics.

use std::{convert::Infallible, sync::Arc};

use bytes::Bytes;
use http_body_util::Full;
use hyper::{
    Method, Request, Response, StatusCode,
    body::Incoming,
    header::{ALLOW, CONTENT_TYPE},
    service::service_fn,
};
use lookdown_common::http_server;
use tokio::net::TcpListener;

use crate::Metrics;

/// Serves the metrics. Never ends.
pub(crate) async fn serve(listener: TcpListener, metrics: Arc<Metrics>) {
    let service = service_fn(move |request: Request<Incoming>| {
        let response = response(&request, &metrics);
        async move { Ok::<_, Infallible>(response) }
    });
    http_server::serve(listener, service).await;
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

//! The HTTP server of the metrics.

use std::sync::Arc;

use axum::{Router, http::header::CONTENT_TYPE, response::IntoResponse, routing::get};
use lookdown_http::protect::{self, Access, Routes};
use tokio::net::TcpListener;

use crate::Metrics;

/// Serves the metrics. Never ends.
pub async fn serve_metrics(listener: TcpListener, metrics: Arc<Metrics>) {
    let access = match listener.local_addr() {
        Ok(address) => Access::without_key(address),
        Err(_) => Access::OwnMachine,
    };
    let open = metrics.series.connections.clone();
    let text = move || {
        let text = metrics.text();
        async move { ([(CONTENT_TYPE, "text/plain; version=0.0.4")], text).into_response() }
    };
    let routes = Routes {
        protected: Router::new().route("/metrics", get(text)),
        probes: Router::new().route("/livez", get(async || "ok\n")),
    };
    protect::serve(listener, routes, access, "metrics_listen", &open).await;
}

//! The routes of the listener itself: metrics, the OpenAPI document, the health check.

use std::sync::Arc;

use axum::{
    Json, Router,
    extract::State,
    http::header::CONTENT_TYPE,
    response::{IntoResponse, Response},
};
use parking_lot::Mutex;
use utoipa::openapi::OpenApi;
use utoipa_axum::{router::OpenApiRouter, routes};

use super::shared::now_ms;
use crate::{counter::Counter, metrics::Metrics};

/// Everything that the routes show.
#[derive(Clone)]
pub(super) struct Shown {
    counter: Arc<Mutex<Counter>>,
    metrics: Arc<Metrics>,
    document: fn() -> OpenApi,
}

/// Returns the routes for clients with access: the metrics and the OpenAPI document.
pub(super) fn router(
    counter: &Arc<Mutex<Counter>>,
    metrics: &Arc<Metrics>,
    document: fn() -> OpenApi,
) -> Router {
    let shown = Shown {
        counter: Arc::clone(counter),
        metrics: Arc::clone(metrics),
        document,
    };
    let (routes, _) = protected().with_state(shown).split_for_parts();
    routes
}

/// Returns the route of the health check.
pub(crate) fn probes() -> Router {
    let (routes, _) = unprotected().split_for_parts();
    routes
}

pub(super) fn protected() -> OpenApiRouter<Shown> {
    OpenApiRouter::new()
        .routes(routes!(metrics))
        .routes(routes!(document))
}

pub(super) fn unprotected() -> OpenApiRouter {
    OpenApiRouter::new().routes(routes!(livez))
}

/// Get the metrics
#[utoipa::path(
    get, path = "/metrics", tag = "operation", operation_id = "get_metrics",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "The text format of Prometheus.", body = String, content_type = "text/plain"))
)]
async fn metrics(State(shown): State<Shown>) -> Response {
    let text = shown.metrics.text(&shown.counter.lock(), now_ms());
    ([(CONTENT_TYPE, "text/plain; version=0.0.4")], text).into_response()
}

/// Get the OpenAPI document
#[utoipa::path(
    get, path = "/openapi.json", tag = "operation", operation_id = "get_openapi",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "OpenAPI 3.1.", body = Object))
)]
async fn document(State(shown): State<Shown>) -> Json<OpenApi> {
    Json((shown.document)())
}

/// Get the liveness
#[utoipa::path(
    get, path = "/livez", tag = "operation", operation_id = "get_liveness",
    responses((status = OK, description = "`ok`.", body = String, content_type = "text/plain"))
)]
async fn livez() -> &'static str {
    "ok\n"
}

//! The only place that knows HTTP. One page of routes; every failure leaves as one envelope.

mod access;
mod blocking;
mod calibrations;
mod cors;
mod crowd;
mod detect;
mod envelope;
mod head;
mod health;
mod incoming_trace;
mod openapi;
mod problem;
mod report;
mod repository;
mod request_id;
mod state;
mod upload;

use axum::{
    Router, extract::DefaultBodyLimit, handler::Handler, middleware, response::Redirect,
    routing::get,
};
use utoipa_axum::{router::OpenApiRouter, routes};
use utoipa_swagger_ui::{Config, SwaggerUi};

use envelope::Surroundings;

pub use access::Access;
pub use health::{Phase, Readiness};
pub use openapi::document as openapi_document;
pub use report::Report;
pub use state::{ApiOptions, ApiState};

/// Every route, with its entry in the OpenAPI document.
fn routes() -> OpenApiRouter<ApiState> {
    service_routes().routes(routes!(health::metrics))
}

/// The same without the metrics.
fn service_routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::with_openapi(<openapi::Common as utoipa::OpenApi>::openapi())
        .routes(routes!(detect::detect_persons))
        .merge(probes())
        .routes(routes!(calibrations::list))
        .routes(routes!(
            calibrations::get,
            calibrations::put,
            calibrations::delete
        ))
        .routes(routes!(calibrations::views::get_views))
        .routes(routes!(openapi::openapi_json))
        .routes(routes!(repository::index))
        .routes(routes!(repository::load))
        .routes(routes!(repository::unload))
}

fn probes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(health::livez))
        .routes(routes!(health::readyz))
}

/// The whole service.
pub fn router(state: ApiState) -> Router {
    let everything = if state.options.metrics_elsewhere {
        service_routes()
    } else {
        routes()
    };
    let (router, _document) = everything.split_for_parts();
    let router = router
        .with_state(state.clone())
        .route("/", get(async || Redirect::temporary("docs/")))
        .merge(api_page());
    surrounded(router, state)
}

/// What is there for operators alone, on a port of its own: metrics and probes.
pub fn operation_router(state: ApiState) -> Router {
    let (router, _document) = probes().routes(routes!(health::metrics)).split_for_parts();
    surrounded(router.with_state(state.clone()), state)
}

/// What answers a connection beyond the limit: probes as ever, and metrics where they are; everything
/// else is refused.
pub fn crowded_router(state: ApiState) -> Router {
    let answered = if state.options.metrics_elsewhere {
        probes()
    } else {
        probes().routes(routes!(health::metrics))
    };
    let (router, _document) = answered.split_for_parts();
    let refuse = crowd::refuse.with_state(state.clone());
    let router = router.with_state(state.clone());
    surrounded(router.fallback_service(refuse), state)
}

/// What holds for every route.
fn surrounded(router: Router, state: ApiState) -> Router {
    let surroundings = Surroundings {
        metrics: state.metrics.clone(),
        tracer: state.options.tracer.clone(),
    };
    let cors = cors::layer(&state.options.cors_origins);
    let bounded_head = middleware::from_fn_with_state(state, head::within_bounds);
    let router = router
        .layer(bounded_head)
        // Bodies are bounded where they are read.
        .layer(DefaultBodyLimit::disable());
    envelope::around(router, cors, surroundings)
}

/// The API page, from files inside the executable; it asks for nothing beyond this server.
fn api_page() -> Router {
    let config = Config::from("../openapi.json")
        .validator_url("none")
        .use_base_layout();
    SwaggerUi::new("/docs").config(config).into()
}

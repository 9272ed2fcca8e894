//! The only place that knows HTTP. One page of routes; every failure leaves as one envelope.

mod access;
mod calibrations;
mod cors;
mod detect;
mod envelope;
mod health;
mod openapi;
mod problem;
mod report;
mod repository;
mod request_id;
mod state;
mod upload;

use axum::{Router, extract::DefaultBodyLimit, response::Redirect, routing::get};
use utoipa_axum::{router::OpenApiRouter, routes};
use utoipa_swagger_ui::{Config, SwaggerUi};

pub use access::Access;
pub use health::{Phase, Readiness};
pub use openapi::document as openapi_document;
pub use report::Report;
pub use state::{ApiOptions, ApiState};

/// Every route, with its entry in the OpenAPI document.
fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::with_openapi(<openapi::Common as utoipa::OpenApi>::openapi())
        .routes(routes!(detect::detect_persons))
        .routes(routes!(health::livez))
        .routes(routes!(health::readyz))
        .routes(routes!(health::metrics))
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

/// The whole service.
pub fn router(state: ApiState) -> Router {
    let metrics = state.metrics.clone();
    let cors = cors::layer(&state.options.cors_origins);
    let (router, _document) = routes().split_for_parts();
    let router = router
        .with_state(state)
        .route("/", get(async || Redirect::temporary("docs/")))
        .merge(api_page())
        // Bodies are bounded where they are read.
        .layer(DefaultBodyLimit::disable());
    envelope::around(router, cors, metrics)
}

/// The API page, from files inside the executable; it asks for nothing beyond this server.
fn api_page() -> Router {
    let config = Config::from("../openapi.json")
        .validator_url("none")
        .use_base_layout();
    SwaggerUi::new("/docs").config(config).into()
}

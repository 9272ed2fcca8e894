//! The HTTP API: the table of routes and the layers around them. No other module uses HTTP. Every
//! failure is returned as a problem document.

mod accept;
mod access;
mod answer;
mod calibrations;
mod caller;
mod connection_limit;
mod cors;
mod csrf;
mod deadline;
mod deepstack;
mod detect;
mod drain_body;
mod entity_tags;
mod envelope;
mod header_limits;
mod health;
mod host;
mod incoming_trace;
mod limit;
mod openapi;
mod page_headers;
mod parameters;
mod problem;
mod rate_limit;
mod report;
mod repository;
mod request_id;
mod results;
mod run_detection;
mod state;
mod upload;
mod v2;
mod web_page;

use axum::{
    Router,
    middleware::{from_fn, from_fn_with_state, map_response},
};
use tower::{ServiceBuilder, util::option_layer};
use tower_http::catch_panic::CatchPanicLayer;
use utoipa_axum::{router::OpenApiRouter, routes};
use utoipa_swagger_ui::{Config, SwaggerUi};

use csrf::AllowedOrigins;
use envelope::Surroundings;
use rate_limit::RateLimiter;

pub use access::Access;
pub use health::{Phase, Readiness};
pub use openapi::document as openapi_document;
pub use problem::pages::problem_table;
pub use rate_limit::RequestRate;
pub use report::Report;
pub use state::{ApiOptions, ApiState};

/// All routes with their entries in the OpenAPI document.
fn routes() -> OpenApiRouter<ApiState> {
    client_routes()
        .merge(deepstack_routes())
        .merge(description())
        .merge(probes())
        .merge(metrics())
}

/// The routes of the native API.
fn client_routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::with_openapi(<openapi::Common as utoipa::OpenApi>::openapi())
        .routes(routes!(detect::detect_persons))
        .routes(routes!(calibrations::list))
        .routes(routes!(
            calibrations::get,
            calibrations::put,
            calibrations::delete
        ))
        .routes(routes!(
            calibrations::views::get_views,
            calibrations::views::try_views
        ))
        .routes(routes!(results::list))
        .routes(routes!(results::latest::get_latest))
        .routes(routes!(results::picture::get_picture))
        .routes(routes!(results::history::get_history))
        .routes(routes!(results::events::of_camera))
        .routes(routes!(results::events::of_all))
        .routes(routes!(v2::describe::model))
        .routes(routes!(v2::describe::model_version))
        .routes(routes!(v2::describe::model_ready))
        .routes(routes!(v2::describe::model_version_ready))
        .routes(routes!(v2::infer::infer))
        .routes(routes!(v2::infer::infer_version))
        .routes(routes!(repository::index))
        .routes(routes!(repository::load))
        .routes(routes!(repository::unload))
}

/// The routes of the DeepStack API.
fn deepstack_routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(deepstack::detect_as_deepstack))
        .routes(routes!(deepstack::detect_as_deepstack_with))
        .routes(routes!(deepstack::list_as_deepstack))
}

fn description() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(openapi::openapi_json))
        .routes(routes!(problem::pages::list_problems))
        .routes(routes!(problem::pages::get_problem))
        .routes(routes!(v2::describe::server))
}

fn probes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(health::livez))
        .routes(routes!(health::readyz))
        .routes(routes!(v2::describe::live))
        .routes(routes!(v2::describe::ready))
}

fn metrics() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(health::metrics))
}

/// The router of the whole service.
pub fn router(state: ApiState) -> Router {
    let options = &state.options;
    let own_pages = AllowedOrigins::of(options).map(|own| from_fn_with_state(own, csrf::refuse));
    let limiter = RateLimiter::of(options).map(|all| from_fn_with_state(all, rate_limit::apply));
    let guards = ServiceBuilder::new()
        .layer(option_layer(own_pages))
        .layer(option_layer(limiter));
    let clients = Router::from(client_routes()).route_layer(guards.clone());
    let deepstack = Router::from(deepstack_routes()).route_layer(guards);
    let router = clients
        .merge(deepstack::with_failures(deepstack))
        .merge(Router::from(description()))
        .merge(operation(state.options.metrics_elsewhere));
    surrounded(router.with_state(state.clone()).merge(pages()), state)
}

/// The router of the metrics port: metrics and health checks for operators.
pub fn operation_router(state: ApiState) -> Router {
    surrounded(operation(false).with_state(state.clone()), state)
}

/// The router for connections beyond the limit: health checks, and metrics unless they have a port
/// of their own. All other requests are refused.
pub fn overload_router(state: ApiState) -> Router {
    let router = operation(state.options.metrics_elsewhere).with_state(state.clone());
    surrounded(router.fallback(connection_limit::refuse), state)
}

fn operation(metrics_elsewhere: bool) -> Router<ApiState> {
    if metrics_elsewhere {
        probes().into()
    } else {
        probes().merge(metrics()).into()
    }
}

/// The pages for browsers.
fn pages() -> Router {
    let api_page = api_page().route_layer(map_response(page_headers::of_api_page));
    web_page::router().merge(api_page)
}

/// Adds the layers of every route, the outermost first. A router clones and boxes each of its
/// layers for each request, so all of these are one layer. A panic of a handler fails only its own
/// request.
fn surrounded(router: Router, state: ApiState) -> Router {
    let surroundings = Surroundings {
        metrics: state.metrics.clone(),
        tracer: state.options.tracer.clone(),
    };
    let layers = ServiceBuilder::new()
        .layer(from_fn_with_state(surroundings, envelope::wrap))
        .layer(option_layer(cors::layer(&state.options.cors_origins)))
        .layer(CatchPanicLayer::custom(envelope::of_panic))
        .layer(from_fn_with_state(state.clone(), drain_body::discard))
        .layer(from_fn_with_state(state, header_limits::within_bounds))
        .layer(from_fn(host::require));
    router.layer(layers)
}

/// The API page, from files inside the executable. It loads nothing from other hosts.
fn api_page() -> Router {
    let config = Config::from("../openapi.json")
        .validator_url("none")
        .use_base_layout();
    SwaggerUi::new("/docs").config(config).into()
}

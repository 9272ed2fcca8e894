//! The HTTP API: the table of routes and the layers around them. No other module uses HTTP. Every
//! failure is returned as a problem document.

mod companions;
mod detect;
mod http;
mod in_process;
mod openapi;
mod parameters;
mod protocols;
mod require_scope;
mod response_memory;
mod routes;
mod state;

use axum::{
    Json, Router,
    extract::State,
    http::HeaderName,
    middleware::{from_fn, from_fn_with_state, map_response},
    routing::get,
};
use lookdown_detect::open_inference::HEAD_LENGTH;
use lookdown_http::{csrf, header_limits, host, page_headers};
use tower::{ServiceBuilder, util::option_layer};
use tower_http::catch_panic::CatchPanicLayer;
use utoipa::openapi::OpenApi;
use utoipa_axum::{router::OpenApiRouter, routes};
use utoipa_swagger_ui::{Config, SwaggerUi};

use self::{
    detect::report::{PERSON_COUNT, SERVER_TIMING},
    http::{
        context::ContextSource,
        cors,
        drain_body::{self, BodyLimits},
        envelope::{self, Envelope},
        problem::Problem,
        rate_limit::{self, RateLimiter},
    },
    protocols::{deepstack, open_inference},
    routes::{counts, health, problems, results::events::LAST_EVENT_ID, web_page},
};

pub use self::{
    companions::Companions,
    detect::report::to_report,
    http::{access::Access, rate_limit::RequestRate},
    in_process::in_process,
    openapi::Document,
    routes::problems::problem_table,
    state::{ApiOptions, ApiState, Phase, Readiness},
};

/// All routes with their entries in the OpenAPI document.
fn routes() -> OpenApiRouter<ApiState> {
    client_routes()
        .merge(deepstack_routes())
        .merge(description())
        .merge(probes())
        .merge(metrics())
}

/// Returns the OpenAPI document of all routes, with those of the counts if their document is given.
///
/// # Errors
/// A document that is not JSON.
pub fn openapi_document(counts: Option<OpenApi>) -> serde_json::Result<Document> {
    let mut document = routes().into_openapi();
    if let Some(mut counts) = counts {
        let tags = counts.tags.iter_mut();
        // Both documents have the tag of health checks and metrics.
        tags.for_each(|tags| tags.retain(|tag| tag.name != "operation"));
        document.merge(counts);
    }
    Document::from_document(&openapi::complete(document))
}

/// Get the OpenAPI document
///
/// It has the routes of the counts if this server has counts.
#[utoipa::path(
    get, path = "/openapi.json", tag = "operation", operation_id = "get_openapi",
    responses((status = OK, description = "OpenAPI 3.1.", body = Object))
)]
async fn openapi_json(State(state): State<ApiState>) -> Result<Json<Document>, Problem> {
    let document = openapi_document(state.options.companions.counts_document());
    document.map(Json).map_err(Problem::internal)
}

/// The routes of the native API and of the Open Inference Protocol.
fn client_routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::with_openapi(<openapi::Common as utoipa::OpenApi>::openapi())
        .merge(routes::client_routes())
        .routes(routes!(open_inference::persons::model))
        .routes(routes!(open_inference::persons::model_ready))
        .routes(routes!(open_inference::infer::infer))
}

/// The routes of the DeepStack API.
fn deepstack_routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(deepstack::detect_as_deepstack))
        .routes(routes!(deepstack::detect_as_deepstack_with))
        .routes(routes!(
            deepstack::list_as_deepstack,
            deepstack::get_list_as_deepstack
        ))
}

fn description() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(openapi_json))
        .routes(routes!(problems::list_problems))
        .routes(routes!(problems::get_problem))
        .routes(routes!(open_inference::persons::server))
        .routes(routes!(deepstack::ping))
        .routes(routes!(deepstack::server_ping))
        .routes(routes!(deepstack::update_available))
}

fn probes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(health::livez))
        .routes(routes!(health::readyz))
        .routes(routes!(open_inference::persons::live))
        .routes(routes!(open_inference::persons::ready))
}

fn metrics() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(health::metrics))
}

/// The router of the whole service.
pub fn router(state: ApiState) -> Router {
    let limiter = state.options.request_rate().map(RateLimiter::new);
    limited_router(state, limiter)
}

/// The router for requests of this process: without a rate limit.
pub fn in_process_router(state: ApiState) -> Router {
    limited_router(state, None)
}

fn limited_router(state: ApiState, limiter: Option<RateLimiter>) -> Router {
    let (options, settings) = (&state.options, &state.options.settings);
    let origins = options.allowed_origins();
    let csrf = origins.as_ref().map(csrf::layer);
    let hosts = origins.map(|origins| from_fn_with_state(origins, csrf::require_host));
    let limiter = limiter.map(|all| from_fn_with_state(all, rate_limit::apply));
    let responses = from_fn_with_state(state.clone(), response_memory::bound);
    let guards = ServiceBuilder::new()
        .layer(responses)
        .layer(option_layer(hosts))
        .layer(option_layer(csrf))
        .layer(option_layer(limiter));
    // Some clients ask for the metadata with a slash at the end.
    let description =
        Router::from(description()).route("/v2/", get(open_inference::persons::server));
    let clients = Router::from(client_routes()).merge(counts::router());
    let clients = clients.route_layer(guards.clone());
    let deepstack = Router::from(deepstack_routes()).route_layer(guards);
    let router = clients
        .merge(deepstack::with_failures(deepstack))
        .merge(description)
        .merge(operation(settings.server.metrics_listen.is_some()));
    with_common_layers(router.merge(pages()), state)
}

/// The router of the metrics port: metrics and health checks for operators.
pub fn operation_router(state: ApiState) -> Router {
    with_common_layers(operation(false), state)
}

fn operation(metrics_elsewhere: bool) -> Router<ApiState> {
    if metrics_elsewhere {
        probes().into()
    } else {
        probes().merge(metrics()).into()
    }
}

/// The pages for browsers.
fn pages() -> Router<ApiState> {
    let api_page = api_page().route_layer(map_response(page_headers::for_api_page));
    web_page::router().merge(api_page)
}

/// Adds the state and the layers of every route, the outermost first. A router clones and boxes
/// each of its layers for each request, so all of these are one layer. A panic of a handler fails
/// only its own request.
fn with_common_layers(router: Router<ApiState>, state: ApiState) -> Router {
    let options = &state.options;
    let envelope = Envelope {
        metrics: state.metrics.clone(),
        contexts: ContextSource {
            tracer: options.tracer.clone(),
            access: options.access.clone(),
            request_timeout: options.settings.server.request_timeout,
        },
    };
    let settings = &options.settings;
    let body_limits = BodyLimits {
        max_body_bytes: settings.server.max_body_bytes,
        min_upload_bytes_per_second: settings.limits.min_upload_bytes_per_second,
    };
    let head_length = HeaderName::from_static(HEAD_LENGTH);
    let sent = [LAST_EVENT_ID, head_length.clone()];
    let read = [SERVER_TIMING, PERSON_COUNT, head_length];
    let has_other_origins = !settings.access.cors_origins.is_empty();
    let for_other_origins =
        has_other_origins.then(|| map_response(page_headers::for_other_origins));
    let layers = ServiceBuilder::new()
        .layer(from_fn_with_state(envelope, envelope::wrap))
        .layer(option_layer(cors::layer(
            &settings.access.cors_origins,
            &sent,
            &read,
        )))
        .layer(CatchPanicLayer::custom(envelope::panic_response))
        .layer(from_fn_with_state(body_limits, drain_body::discard))
        .layer(from_fn_with_state(
            settings.connections.clone(),
            header_limits::within_bounds,
        ))
        .layer(from_fn(host::require))
        .layer(option_layer(for_other_origins));
    router.with_state(state).layer(layers)
}

/// The API page, from files inside the executable. It loads nothing from other hosts.
fn api_page() -> Router<ApiState> {
    let config = Config::from("../openapi.json")
        .validator_url("none")
        .use_base_layout();
    SwaggerUi::new("/docs").config(config).into()
}

//! The HTTP API of the companion.

mod counts;
mod floor;
mod furniture;
mod heat_map;
mod reference_crossings;
mod shared;
mod time;
mod tracks;

use std::{collections::BTreeMap, sync::Arc};

use axum::{
    Json, Router,
    extract::State,
    http::{
        HeaderValue,
        header::{CACHE_CONTROL, CONTENT_TYPE},
    },
    middleware,
    response::{IntoResponse, Response},
};
use jiff::Timestamp;
use lookdown_http::{
    openapi::{Keys, complete},
    problem::ProblemBody,
};
use parking_lot::Mutex;
use serde::Serialize;
use utoipa::{OpenApi as _, ToSchema, openapi::OpenApi};
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{counter::Counter, metrics::Metrics, now::time_of, sums::Owner};

use counts::ZoneCounts;
use shared::{Shared, now_ms};

pub(crate) use counts::{MAX_VALUES, table};
pub(crate) use shared::Api;

/// Returns the routes, without protection: a listener adds it.
pub(crate) fn router(api: Api) -> Router {
    let (routes, _) = routes().split_for_parts();
    routes
        .layer(middleware::map_response(without_cache))
        .with_state(Arc::new(api))
}

/// Returns the routes with their entries in the OpenAPI document.
fn routes() -> OpenApiRouter<Shared> {
    OpenApiRouter::new()
        .routes(routes!(cameras))
        .routes(routes!(counts::camera_counts, counts::delete))
        .routes(routes!(tracks::camera_tracks))
        .routes(routes!(floor::list))
        .routes(routes!(floor::acknowledge))
        .routes(routes!(furniture::list))
        .routes(routes!(furniture::confirm, furniture::take_back))
        .routes(routes!(reference_crossings::list))
        .routes(routes!(
            reference_crossings::put,
            reference_crossings::delete
        ))
        .routes(routes!(heat_map::json_of_camera))
        .routes(routes!(heat_map::png_of_camera))
        .routes(routes!(heat_map::png_of_frame))
        .routes(routes!(heat_map::suggest_area))
        .routes(routes!(counts::site_counts))
        .routes(routes!(tracks::site_tracks))
        .routes(routes!(heat_map::json_of_site))
        .routes(routes!(heat_map::png_of_site))
}

/// Returns the routes of the listener itself for clients with access: the metrics and the OpenAPI
/// document.
pub(crate) fn operation_router(counter: &Arc<Mutex<Counter>>, metrics: &Arc<Metrics>) -> Router {
    let shown = Shown {
        counter: Arc::clone(counter),
        metrics: Arc::clone(metrics),
    };
    let (routes, _) = protected().with_state(shown).split_for_parts();
    routes
}

/// Returns the OpenAPI document of the counts.
pub fn openapi_document() -> OpenApi {
    merged_documents([
        routes().into_openapi(),
        protected().into_openapi(),
        unprotected().into_openapi(),
    ])
}

async fn without_cache(mut response: Response) -> Response {
    let headers = response.headers_mut().entry(CACHE_CONTROL);
    headers.or_insert(HeaderValue::from_static("no-store"));
    response
}

/// A camera of the list.
#[derive(Serialize, ToSchema)]
struct CountedCamera {
    /// The name.
    name: String,
    /// Time of the last counted frame.
    last_report: Option<Timestamp>,
    /// Persons now; null while unknown.
    persons: Option<u64>,
    /// In 90 % of frames, the true number is at least this one; null while unknown.
    persons_low: Option<u64>,
    /// In 90 % of frames, the true number is at most this one; null while unknown.
    persons_high: Option<u64>,
    /// Since when its lines have too few frames, so that crossings may be missed; null if they have
    /// enough.
    too_low_since: Option<Timestamp>,
    /// The site of its calibration.
    site: Option<String>,
    /// Reports that were not counted since the start.
    dropped_reports: u64,
    /// Since when none was counted.
    dropping: Option<Dropping>,
}

/// Reports of a camera that are not counted now.
#[derive(Serialize, ToSchema)]
struct Dropping {
    /// Time of the first of them.
    since: Timestamp,
    /// The reason, as in `lookdown_count_reports_skipped_total`.
    reason: &'static str,
}

impl CountedCamera {
    /// Returns the row of a camera without a counted report.
    fn new(name: &str, counter: &Counter) -> Self {
        let drops = counter.drops.for_camera(name);
        let since_ms = drops.and_then(|drops| drops.since_ms);
        let dropping = drops.zip(since_ms).map(|(drops, since_ms)| Dropping {
            since: time_of(since_ms),
            reason: drops.reason.label(),
        });
        Self {
            name: name.to_owned(),
            last_report: None,
            persons: None,
            persons_low: None,
            persons_high: None,
            too_low_since: None,
            site: None,
            dropped_reports: drops.map_or(0, |drops| drops.reports),
            dropping,
        }
    }
}

/// List counted cameras
#[utoipa::path(
    get, path = "/counts", tag = "counts", operation_id = "list_counted_cameras",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "By name.", body = Vec<CountedCamera>))
)]
async fn cameras(State(api): State<Shared>) -> Json<Vec<CountedCamera>> {
    let counter = api.counter.lock();
    let snapshot = counter.snapshot(now_ms());
    let mut rows = BTreeMap::new();
    for camera in snapshot.cameras {
        let row = CountedCamera {
            last_report: Some(time_of(camera.last_report_ms)),
            persons: camera.persons,
            persons_low: camera.bar.map(|[low, _]| low),
            persons_high: camera.bar.map(|[_, high]| high),
            too_low_since: camera.too_low_since_ms.map(time_of),
            site: match counter.scene_of(&camera.name).map(|scene| &scene.owner) {
                Some(Owner::Site(site)) => Some(site.clone()),
                _ => None,
            },
            ..CountedCamera::new(&camera.name, &counter)
        };
        rows.insert(camera.name, row);
    }
    for (name, _) in counter.drops.iter() {
        let entry = rows.entry(name.to_owned());
        entry.or_insert_with(|| CountedCamera::new(name, &counter));
    }
    Json(rows.into_values().collect())
}

#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "Counts of Lookdown",
        description = "Counts people over time: lines, zones, tracks and heat maps. `lookdown count` has \
                       these routes on an address of its own, `lookdown run` and a server with \
                       `counts.url` on the address of the server, for keys with the scope `read`. Every \
                       failure is a problem document (RFC 9457).",
        contact(name = "The Lookdown authors")
    ),
    servers((url = "/", description = "This server")),
    tags(
        (name = "counts", description = "Cameras."),
        (name = "sites", description = "Cameras that share a floor."),
        (name = "operation", description = "Health checks, metrics and documentation of the address of `lookdown count`."),
    ),
    components(schemas(ProblemBody, ZoneCounts)),
    modifiers(&Keys)
)]
struct Common;

/// Returns the document of these routes.
fn merged_documents(routes: impl IntoIterator<Item = OpenApi>) -> OpenApi {
    let mut document = Common::openapi();
    for part in routes {
        document.merge(part);
    }
    complete(&mut document);
    document
}

/// Everything that the routes show.
#[derive(Clone)]
struct Shown {
    counter: Arc<Mutex<Counter>>,
    metrics: Arc<Metrics>,
}

/// Returns the route of the health check.
pub(crate) fn probes() -> Router {
    let (routes, _) = unprotected().split_for_parts();
    routes
}

fn protected() -> OpenApiRouter<Shown> {
    OpenApiRouter::new()
        .routes(routes!(metrics))
        .routes(routes!(document))
}

fn unprotected() -> OpenApiRouter {
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
async fn document() -> Json<OpenApi> {
    Json(openapi_document())
}

/// Get the liveness
#[utoipa::path(
    get, path = "/livez", tag = "operation", operation_id = "get_liveness",
    responses((status = OK, description = "`ok`.", body = String, content_type = "text/plain"))
)]
async fn livez() -> &'static str {
    "ok\n"
}

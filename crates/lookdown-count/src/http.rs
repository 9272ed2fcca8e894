//! The HTTP API of the companion.

mod counts;
mod floor;
mod frame_heat_map;
mod heat_map;
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
    response::Response,
    routing::get,
};
use jiff::Timestamp;
use parking_lot::Mutex;
use serde::Serialize;

use crate::{engine::Engine, metrics::Metrics, sums::Owner};
pub(crate) use counts::{MAX_VALUES, table};
pub(crate) use shared::Api;
use shared::{Shared, now_ms};

/// Returns the routes, without protection: a listener adds it.
pub(crate) fn router(api: Api) -> Router {
    Router::new()
        .route("/counts", get(cameras))
        .route("/counts/{camera}", get(counts::of_camera))
        .route("/counts/{camera}/tracks", get(tracks::of_camera))
        .route(
            "/counts/{camera}/heatmap.json",
            get(heat_map::json_of_camera),
        )
        .route("/counts/{camera}/heatmap.png", get(heat_map::png_of_camera))
        .route(
            "/counts/{camera}/heatmap-frame.png",
            get(frame_heat_map::png),
        )
        .route("/sites/{site}", get(counts::of_site))
        .route("/sites/{site}/tracks", get(tracks::of_site))
        .route("/sites/{site}/heatmap.json", get(heat_map::json_of_site))
        .route("/sites/{site}/heatmap.png", get(heat_map::png_of_site))
        .route("/sites/{site}/floor.svg", get(floor::svg))
        .layer(middleware::map_response(without_cache))
        .with_state(Arc::new(api))
}

/// Returns the route of the metrics.
pub(crate) fn metrics_router(engine: &Arc<Mutex<Engine>>, metrics: &Arc<Metrics>) -> Router {
    let (engine, metrics) = (Arc::clone(engine), Arc::clone(metrics));
    let text = async move || {
        let text = metrics.text(&engine.lock(), now_ms());
        ([(CONTENT_TYPE, "text/plain; version=0.0.4")], text)
    };
    Router::new().route("/metrics", get(text))
}

/// Returns the route of the health check.
pub(crate) fn probes() -> Router {
    Router::new().route("/livez", get(async || "ok\n"))
}

async fn without_cache(mut response: Response) -> Response {
    let value = HeaderValue::from_static("no-store");
    response.headers_mut().insert(CACHE_CONTROL, value);
    response
}

/// A camera of the list.
#[derive(Serialize)]
struct CameraRow {
    name: String,
    last_report: Option<Timestamp>,
    persons: Option<u64>,
    site: Option<String>,
    /// Reports that were not counted since the start.
    dropped_reports: u64,
    /// Since when none was counted.
    dropping: Option<Dropping>,
}

/// Reports of a camera that are not counted now.
#[derive(Serialize)]
struct Dropping {
    since: Option<Timestamp>,
    reason: &'static str,
}

impl CameraRow {
    /// Returns the row of a camera without a counted report.
    fn new(name: &str, engine: &Engine) -> Self {
        let drops = engine.drops().of(name);
        let since_ms = drops.and_then(|drops| drops.since_ms);
        let dropping = drops.zip(since_ms).map(|(drops, since_ms)| Dropping {
            since: Timestamp::from_millisecond(since_ms).ok(),
            reason: drops.reason.label(),
        });
        Self {
            name: name.to_owned(),
            last_report: None,
            persons: None,
            site: None,
            dropped_reports: drops.map_or(0, |drops| drops.reports),
            dropping,
        }
    }
}

async fn cameras(State(api): State<Shared>) -> Json<Vec<CameraRow>> {
    let engine = api.engine.lock();
    let snapshot = engine.snapshot(now_ms());
    let mut rows = BTreeMap::new();
    for camera in snapshot.cameras {
        let row = CameraRow {
            last_report: Timestamp::from_millisecond(camera.last_report_ms).ok(),
            persons: camera.persons,
            site: match engine.scene_of(&camera.name).map(|scene| &scene.owner) {
                Some(Owner::Site(site)) => Some(site.clone()),
                _ => None,
            },
            ..CameraRow::new(&camera.name, &engine)
        };
        rows.insert(camera.name, row);
    }
    for (name, _) in engine.drops().iter() {
        let entry = rows.entry(name.to_owned());
        entry.or_insert_with(|| CameraRow::new(name, &engine));
    }
    Json(rows.into_values().collect())
}

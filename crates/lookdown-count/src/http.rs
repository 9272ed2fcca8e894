//! The HTTP API of the companion.

mod counts;
mod floor;
mod frame_heat_map;
mod heat_map;
mod problem;
mod time;
mod tracks;

use std::{collections::BTreeMap, sync::Arc};

use axum::{
    Json, Router,
    extract::{Request, State},
    http::{
        HeaderMap, HeaderValue, Method,
        header::{AUTHORIZATION, CACHE_CONTROL, CONTENT_TYPE},
    },
    middleware::{self, Next},
    response::{IntoResponse, Response},
    routing::get,
};
use jiff::Timestamp;
use parking_lot::Mutex;
use secrecy::{ExposeSecret, SecretString};
use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::{engine::Engine, metrics::Metrics, store::Store, sums::Owner};
use problem::Problem;

/// Everything that requests read.
#[expect(clippy::struct_field_names, reason = "a key of the API")]
pub(crate) struct Api {
    pub(crate) engine: Arc<Mutex<Engine>>,
    pub(crate) store: Store,
    pub(crate) metrics: Arc<Metrics>,
    pub(crate) api_key: Option<SecretString>,
}

type Shared = Arc<Api>;

/// Returns the routes.
pub(crate) fn router(api: Api) -> Router {
    let api = Arc::new(api);
    let with_key = Router::new()
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
        .route("/metrics", get(metrics))
        .layer(middleware::from_fn_with_state(Arc::clone(&api), check_key));
    Router::new()
        .route("/livez", get(async || "ok\n"))
        .merge(with_key)
        .fallback(async |request: Request| {
            Problem::not_found(format!(
                "there is no resource at {}: docs/count.md lists all paths",
                request.uri().path()
            ))
        })
        .method_not_allowed_fallback(async |method: Method| Problem::method(&method))
        .layer(middleware::map_response(without_cache))
        .with_state(api)
}

async fn without_cache(mut response: Response) -> Response {
    let value = axum::http::HeaderValue::from_static("no-store");
    response.headers_mut().insert(CACHE_CONTROL, value);
    response
}

/// Requires the key of the settings.
async fn check_key(State(api): State<Shared>, request: Request, next: Next) -> Response {
    match &api.api_key {
        Some(key) if !has_key(request.headers(), key) => Problem::unauthorized().into_response(),
        _ => next.run(request).await,
    }
}

fn has_key(headers: &HeaderMap, key: &SecretString) -> bool {
    let bearer = headers.get(AUTHORIZATION);
    let bearer = bearer.and_then(|value| value.as_bytes().strip_prefix(b"Bearer "));
    let plain = headers.get("x-api-key").map(HeaderValue::as_bytes);
    // Digests of equal length make the time of the comparison independent of the key.
    let wanted = Sha256::digest(key.expose_secret());
    let given = bearer.or(plain);
    given.is_some_and(|given| Sha256::digest(given) == wanted)
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

async fn metrics(State(api): State<Shared>) -> Response {
    let text = api.metrics.text(&api.engine.lock(), now_ms());
    ([(CONTENT_TYPE, "text/plain; version=0.0.4")], text).into_response()
}

fn now_ms() -> i64 {
    Timestamp::now().as_millisecond()
}

/// Runs a query of the store without blocking the runtime.
async fn query<T: Send + 'static>(
    api: &Shared,
    query: impl FnOnce(&Store) -> Result<T, crate::store::StoreError> + Send + 'static,
) -> Result<T, Problem> {
    let store = api.store.clone();
    let answer = tokio::task::spawn_blocking(move || query(&store)).await;
    match answer {
        Ok(Ok(answer)) => Ok(answer),
        Ok(Err(problem)) => {
            tracing::error!("{problem}");
            Err(Problem::internal())
        }
        // A task that panicked is logged by the panic hook.
        Err(_) => Err(Problem::internal()),
    }
}

/// Refuses an owner that has neither a scene nor sums.
async fn check_known(api: &Shared, owner: &Owner) -> Result<(), Problem> {
    let is_followed = match owner {
        Owner::Camera(camera) => api.engine.lock().scene_of(camera).is_some(),
        Owner::Site(site) => api.engine.lock().site(site).is_some(),
    };
    if is_followed {
        return Ok(());
    }
    let asked = owner.clone();
    if query(api, move |store| store.has(&asked)).await? {
        return Ok(());
    }
    Err(match owner {
        Owner::Camera(camera) => Problem::not_found(format!(
            "there is no camera {}: GET /counts lists them",
            lookdown_common::text::one_line(camera)
        )),
        Owner::Site(site) => Problem::not_found(format!(
            "there is no site {}: give a mount.site of a calibration in use",
            lookdown_common::text::one_line(site)
        )),
    })
}

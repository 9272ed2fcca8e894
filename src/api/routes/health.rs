//! Health checks and metrics.

use std::{collections::BTreeSet, time::Instant};

use axum::{
    Json,
    extract::State,
    http::{HeaderMap, header::CONTENT_TYPE},
    response::IntoResponse,
};
use utoipa::ToSchema;

use crate::{
    api::{ApiState, http::problem::Problem, require_scope::RequireRead},
    calibration::CalibrationId,
    calibration_store::CalibrationsHealth,
};

/// Largest number of invalid files in a response.
const MAX_PROBLEMS: usize = 100;

/// The liveness of the server.
#[derive(serde::Serialize, ToSchema)]
pub(in crate::api) struct Health {
    /// `alive`.
    #[schema(example = "alive")]
    status: &'static str,
}

/// The readiness of the server.
#[derive(serde::Serialize, ToSchema)]
pub(in crate::api) struct Ready {
    /// `ready`.
    #[schema(example = "ready")]
    status: &'static str,
    /// The state of the calibrations.
    calibrations: CalibrationHealth,
    /// The state of the result store.
    results: ResultsHealth,
}

/// The state of the result store.
#[derive(serde::Serialize, ToSchema)]
struct ResultsHealth {
    /// The reason why the store cannot be reached, if it cannot. Reports are queued until it can.
    #[serde(skip_serializing_if = "Option::is_none")]
    store_problem: Option<String>,
}

/// The state of the calibrations.
#[derive(serde::Serialize, ToSchema)]
#[schema(example = json!({ "serving": 12, "problem_count": 1, "problems": [
    { "file": "lobby.json", "problem": "image: 4×4 pixels; each side must be 16 to 65536" }
] }))]
struct CalibrationHealth {
    /// Number of calibrations in use.
    serving: usize,
    /// Number of files whose newest version cannot be used.
    problem_count: usize,
    /// These files, at most 100; empty for clients that may not read calibrations.
    problems: Vec<FileProblem>,
    /// The reason why the calibration store cannot be read, if it cannot. Without details for clients
    /// that may not read calibrations.
    #[serde(skip_serializing_if = "Option::is_none")]
    store_problem: Option<String>,
}

/// A file that cannot be used.
#[derive(serde::Serialize, ToSchema)]
struct FileProblem {
    /// The name of the file.
    file: String,
    /// The reason.
    problem: String,
}

impl CalibrationHealth {
    /// Describes the calibrations, with names and reasons if `has_details`.
    fn new(health: CalibrationsHealth, has_details: bool) -> Self {
        let problem_count = health.problems.len();
        let shown = if has_details { MAX_PROBLEMS } else { 0 };
        let problems = health.problems.into_iter().take(shown);
        Self {
            serving: health.serving,
            problem_count,
            problems: problems
                .map(|(file, problem)| FileProblem { file, problem })
                .collect(),
            store_problem: described(health.store_problem, has_details),
        }
    }
}

/// Returns the problem of a store, without its details unless `has_details`.
fn described(problem: Option<String>, has_details: bool) -> Option<String> {
    let hidden =
        || "the store is unavailable; a key with the scope read shows the reason".to_owned();
    problem.map(|problem| if has_details { problem } else { hidden() })
}

/// Check liveness
///
/// Independent of readiness: restart the process only when this check fails.
#[utoipa::path(
    get, path = "/livez", tag = "operation", operation_id = "get_liveness",
    responses((status = OK, description = "The process is alive.", body = Health))
)]
pub(in crate::api) async fn livez() -> Json<Health> {
    Json(Health { status: "alive" })
}

/// Check readiness
///
/// Ready after the first run of the models, unless the inference server does not respond, frames
/// make no progress for twice `server.request_timeout_millis`, or the server is shutting down.
/// Invalid calibration files and an unreachable result store are reported,
/// but the server stays ready: the previous calibrations remain in use.
#[utoipa::path(
    get, path = "/readyz", tag = "operation", operation_id = "get_readiness",
    responses(
        (status = OK, description = "The server accepts frames.", body = Ready),
    )
)]
pub(in crate::api) async fn readyz(
    State(state): State<ApiState>,
    headers: HeaderMap,
) -> Result<Json<Ready>, Problem> {
    state.require_ready()?;
    let has_details = RequireRead::check(&state, &headers).is_ok();
    Ok(Json(Ready {
        status: "ready",
        calibrations: CalibrationHealth::new(state.calibrations.health(), has_details),
        results: ResultsHealth {
            store_problem: described(state.results.health().problem, has_details),
        },
    }))
}

/// Get metrics
///
/// Returns the Prometheus text format.
#[utoipa::path(
    get, path = "/metrics", tag = "operation", operation_id = "get_metrics",
    responses(
        (status = OK, description = "All metrics.", body = String, content_type = "text/plain"),
    )
)]
pub(in crate::api) async fn metrics(
    State(state): State<ApiState>,
) -> Result<impl IntoResponse, Problem> {
    let workers = &state.workers;
    state
        .metrics
        .show_frames(workers.pending(), workers.withdrawn());
    let quiet = workers.quiet_for(Instant::now());
    state.metrics.show_progress(quiet, workers.stalls());
    show_models(&state);
    show_remote(&state);
    show_calibrations(&state);
    forget_zones(&state);
    let rigs = state.workers.engine().rig_cache_use();
    state
        .metrics
        .show_rig_cache(rigs.rigs, rigs.bytes, rigs.builds, rigs.evictions);
    let recalled = state.workers.engine().inference_cache_hits();
    state.metrics.show_recalled(recalled);
    show_results(&state).await;
    let text = state.metrics.render().map_err(Problem::internal)?;
    Ok(([(CONTENT_TYPE, "text/plain; version=0.0.4")], text))
}

/// Updates the metrics of the result store and of its subscribers.
async fn show_results(state: &ApiState) {
    let metrics = &state.metrics;
    if let Ok(kept) = state.results.usage().await {
        metrics.show_results(kept.cameras, kept.reports, kept.bytes, kept.pictures);
    }
    let health = state.results.health();
    let up = health.problem.is_none();
    metrics.show_result_store(up, health.waiting, health.stored, health.dropped);
    let listeners = state.results.listeners();
    metrics.show_listeners(listeners.count(), listeners.dropped());
}

/// Updates the metrics of the models.
fn show_models(state: &ApiState) {
    let models = state.models.registry().all();
    let rows: Vec<_> = models
        .iter()
        .map(|model| (model.name(), model.revision()))
        .collect();
    let counts = state.models.load_counts();
    let loads = [("success", counts.succeeded), ("failure", counts.failed)];
    state.metrics.show_models(&rows, &loads);
}

/// Updates the metrics of the inference server, if there is one.
fn show_remote(state: &ApiState) {
    let Some(remote) = state.models.remote() else {
        return;
    };
    let counts = remote.counts();
    let requests = [
        ("answered", counts.answered),
        ("busy", counts.busy),
        ("failed", counts.failed),
        ("not_sent", counts.not_sent),
    ];
    state.metrics.show_remote(remote.is_available(), &requests);
}

/// Removes the metrics of zones that no calibration has any longer.
fn forget_zones(state: &ApiState) {
    state.metrics.retain_zones(|calibration, zone| {
        let entry = calibration.parse::<CalibrationId>().ok();
        let entry = entry.and_then(|id| state.calibrations.entry(&id));
        entry.is_some_and(|entry| {
            let mut zones = entry.calibration.areas().zones.iter();
            zones.any(|known| known.name == zone)
        })
    });
}

/// Updates the metrics of the calibrations.
fn show_calibrations(state: &ApiState) {
    let health = state.calibrations.health();
    let files: BTreeSet<_> = health.problems.iter().map(|(file, _)| file).collect();
    let loads = [
        ("success", health.loads_succeeded),
        ("failure", health.loads_failed),
    ];
    let up = health.store_problem.is_none();
    state
        .metrics
        .show_calibrations(health.serving, &health.revision, files.len(), up, &loads);
}

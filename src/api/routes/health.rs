//! Health checks and metrics.

use std::time::Instant;

use axum::{
    Json,
    extract::{Request, State},
    http::header::CONTENT_TYPE,
    response::IntoResponse,
};
use lookdown_detect::metrics::gauge_value;
use utoipa::ToSchema;

use crate::{
    api::{ApiState, http::problem::Problem, require_scope::RequireRead},
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
    /// The reason why the calibration store cannot be read, if it cannot. Without details for
    /// clients that may not read calibrations.
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
    reader: Result<RequireRead, Problem>,
) -> Result<Json<Ready>, Problem> {
    state.require_ready()?;
    let has_details = reader.is_ok();
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
/// Returns the Prometheus text format. Lines with a camera, a line, a zone or a site are for
/// clients that may read.
#[utoipa::path(
    get, path = "/metrics", tag = "operation", operation_id = "get_metrics",
    responses(
        (status = OK, description = "All metrics.", body = String, content_type = "text/plain"),
    )
)]
pub(in crate::api) async fn metrics(
    State(state): State<ApiState>,
    reader: Result<RequireRead, Problem>,
    request: Request,
) -> Result<impl IntoResponse, Problem> {
    read_gauges(&state).await;
    read_cameras(&state).await;
    let mut text = state.metrics.render().map_err(Problem::internal)?;
    state.options.companions.add_metrics(&mut text);
    let own_pages = state.options.allowed_origins();
    if reader.is_err() || own_pages.is_some_and(|own| !own.admits(&request)) {
        text = without_cameras(&text);
    }
    Ok(([(CONTENT_TYPE, "text/plain; version=0.0.4")], text))
}

/// The labels that only clients that may read see. A backslash precedes each quotation mark in a
/// value.
const READERS_LABELS: [&str; 4] = ["camera=\"", "line=\"", "site=\"", "zone=\""];

/// Returns the metrics without the lines of cameras.
fn without_cameras(text: &str) -> String {
    let is_open = |line: &&str| !READERS_LABELS.iter().any(|label| line.contains(label));
    text.split_inclusive('\n').filter(is_open).collect()
}

/// Sets the gauges that are read and not counted: an age, lengths of queues, and the use of a
/// result store that other servers change, too.
async fn read_gauges(state: &ApiState) {
    let (metrics, workers) = (&state.metrics, &state.workers);
    metrics.pending_frames.set(gauge_value(workers.pending()));
    let quiet = workers.quiet_for(Instant::now()).as_secs();
    metrics.seconds_without_progress.set(gauge_value(quiet));
    let waiting = state.results.health().waiting;
    metrics.results_waiting.set(gauge_value(waiting));
    if let Ok(usage) = state.results.usage().await {
        for (gauge, count) in [
            (&metrics.results_cameras, usage.cameras),
            (&metrics.results_reports, usage.reports),
            (&metrics.results_bytes, usage.bytes),
            (&metrics.results_images, usage.images),
        ] {
            gauge.set(gauge_value(count));
        }
    }
}

/// Sets the metrics of the cameras in the result store, and removes those of others and of paused
/// ones.
async fn read_cameras(state: &ApiState) {
    if !(state.options.settings.calibrations.zone_metrics
        || state.options.settings.results.camera_metrics)
    {
        return;
    }
    let Ok(mut latest) = state.results.latest_of_all().await else {
        return;
    };
    let own = state.options.companions.own_cameras();
    latest.retain(|report| !own.is_paused(&report.report.camera));
    let cameras = latest.iter().map(|report| report.report.camera.clone());
    state.metrics.retain_cameras(&cameras.collect::<Vec<_>>());
    for report in latest
        .iter()
        .filter(|_| state.options.settings.results.camera_metrics)
    {
        let Ok(headline) = state.headline(report).await else {
            return;
        };
        let Some(number) = headline.number else {
            continue;
        };
        let at = report.id.time().as_duration().as_secs_f64();
        let camera = &report.report.camera;
        state.metrics.set_camera(camera, number, at);
    }
}

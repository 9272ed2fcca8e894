//! Probes: alive, ready, and what the metrics say.

use std::collections::BTreeSet;

use axum::{Json, extract::State, http::header::CONTENT_TYPE, response::IntoResponse};
use tokio::sync::watch;
use utoipa::ToSchema;

use super::{ApiState, problem::Problem};
use crate::{
    calibration::{CalibrationId, CalibrationsHealth},
    pipeline::PipelineError,
};

/// Most broken files told.
const MAX_PROBLEMS: usize = 100;

/// Where the server is between its start and its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// The network has not run yet.
    WarmingUp,
    /// Frames are welcome.
    Ready,
    /// The server was told to stop: what has arrived is finished.
    Stopping,
}

/// The current [`Phase`]. Clones share it.
#[derive(Debug, Clone)]
pub struct Readiness(watch::Sender<Phase>);

impl Default for Readiness {
    fn default() -> Self {
        Self(watch::Sender::new(Phase::WarmingUp))
    }
}

impl Readiness {
    /// The warm-up has ended. Does not call back a server that was told to stop meanwhile.
    pub fn warmed_up(&self) {
        self.0.send_if_modified(|phase| {
            let warming_up = *phase == Phase::WarmingUp;
            if warming_up {
                *phase = Phase::Ready;
            }
            warming_up
        });
    }

    /// The server was told to stop.
    pub fn stopping(&self) {
        self.0.send_replace(Phase::Stopping);
    }

    /// The phase now.
    #[must_use]
    pub fn phase(&self) -> Phase {
        *self.0.borrow()
    }

    /// Waits for the end of the warm-up.
    pub async fn ready(&self) {
        // The sender is `self`, so the channel cannot close meanwhile.
        let _ = self
            .0
            .subscribe()
            .wait_for(|phase| *phase != Phase::WarmingUp)
            .await;
    }
}

/// How the server is.
#[derive(serde::Serialize, ToSchema)]
pub(super) struct Health {
    /// `alive`.
    #[schema(example = "alive")]
    status: &'static str,
}

/// How a server is that takes frames.
#[derive(serde::Serialize, ToSchema)]
pub(super) struct Ready {
    /// `ready`.
    #[schema(example = "ready")]
    status: &'static str,
    /// How its calibrations are.
    calibrations: CalibrationHealth,
    /// How the place of its results is.
    results: ResultsHealth,
}

/// How the place of the results is.
#[derive(serde::Serialize, ToSchema)]
struct ResultsHealth {
    /// Why it cannot be reached, if it cannot. Reports wait for it meanwhile.
    #[serde(skip_serializing_if = "Option::is_none")]
    store_problem: Option<String>,
}

/// How the calibrations are.
#[derive(serde::Serialize, ToSchema)]
#[schema(example = json!({ "serving": 12, "problems": [
    { "file": "lobby.json", "problem": "image: 4×4 pixels; each side must be 16 to 65536" }
] }))]
struct CalibrationHealth {
    /// How many serve.
    serving: usize,
    /// Files whose newest version cannot be used; at most 100 are told.
    problems: Vec<FileProblem>,
    /// Why their place cannot be looked at, if it cannot.
    #[serde(skip_serializing_if = "Option::is_none")]
    store_problem: Option<String>,
}

/// A file that cannot be used.
#[derive(serde::Serialize, ToSchema)]
struct FileProblem {
    /// Its name.
    file: String,
    /// Why.
    problem: String,
}

impl From<CalibrationsHealth> for CalibrationHealth {
    fn from(health: CalibrationsHealth) -> Self {
        let problems = health.problems.into_iter().take(MAX_PROBLEMS);
        Self {
            serving: health.serving,
            problems: problems
                .map(|(file, problem)| FileProblem { file, problem })
                .collect(),
            store_problem: health.store_problem,
        }
    }
}

/// Is the process alive?
///
/// Says nothing about whether frames can be answered: restart the process only when this fails.
#[utoipa::path(
    get, path = "/livez", tag = "operation", operation_id = "get_liveness",
    responses((status = OK, description = "The process answers.", body = Health))
)]
pub(super) async fn livez() -> Json<Health> {
    Json(Health { status: "alive" })
}

/// Can frames be sent?
///
/// Not before the network has run once, not while the server that it runs on does not answer, and no
/// longer when this server was told to stop. Files of
/// calibrations that cannot be used are told, but stop nothing: what was known of them goes on. Nor does a
/// place of results that cannot be reached.
#[utoipa::path(
    get, path = "/readyz", tag = "operation", operation_id = "get_readiness",
    responses(
        (status = OK, description = "Frames can be sent.", body = Ready),
    )
)]
pub(super) async fn readyz(State(state): State<ApiState>) -> Result<Json<Ready>, Problem> {
    require_ready(&state)?;
    Ok(Json(Ready {
        status: "ready",
        calibrations: CalibrationHealth::from(state.calibrations.health()),
        results: ResultsHealth {
            store_problem: state.results.health().problem,
        },
    }))
}

/// Refuses while frames cannot be sent, and says why.
pub(super) fn require_ready(state: &ApiState) -> Result<(), Problem> {
    let remote = state.models.remote();
    match state.readiness.phase() {
        Phase::Ready if remote.is_none_or(|remote| remote.is_available()) => Ok(()),
        Phase::Ready => Err(PipelineError::InferenceUnavailable.into()),
        Phase::WarmingUp => Err(Problem::warming_up()),
        Phase::Stopping => Err(Problem::shutting_down()),
    }
}

/// Metrics in the Prometheus text format.
#[utoipa::path(
    get, path = "/metrics", tag = "operation", operation_id = "get_metrics",
    responses(
        (status = OK, description = "All metrics.", body = String, content_type = "text/plain"),
    )
)]
pub(super) async fn metrics(State(state): State<ApiState>) -> Result<impl IntoResponse, Problem> {
    let workers = &state.workers;
    state
        .metrics
        .show_frames(workers.pending(), workers.withdrawn());
    show_models(&state);
    show_remote(&state);
    show_calibrations(&state);
    forget_zones(&state);
    let rigs = state.workers.engine().rig_cache_use();
    state
        .metrics
        .show_rig_cache(rigs.rigs, rigs.bytes, rigs.builds, rigs.evictions);
    let recalled = state.workers.engine().recalled_frames();
    state.metrics.show_recalled(recalled);
    show_results(&state).await;
    let text = state.metrics.render().map_err(Problem::internal)?;
    Ok(([(CONTENT_TYPE, "text/plain; version=0.0.4")], text))
}

/// The kept reports, and who listens, as they are at this scrape.
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

/// The models as they are at this scrape.
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

/// The server that networks run on, if there is one.
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

/// Of the zones, those that their calibrations still have.
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

/// The calibrations as they are at this scrape.
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

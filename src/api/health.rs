//! Probes: alive, ready, and what the metrics say.

use axum::{Json, extract::State, http::header::CONTENT_TYPE, response::IntoResponse};
use tokio::sync::watch;
use utoipa::ToSchema;

use super::{
    ApiState,
    openapi::{FaultProblem, NotReadyProblems},
    problem::Problem,
};

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
    /// `alive` or `ready`.
    #[schema(example = "ready")]
    status: &'static str,
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
/// Not before the network has run once, and no longer when the server was told to stop.
#[utoipa::path(
    get, path = "/readyz", tag = "operation", operation_id = "get_readiness",
    responses(
        (status = OK, description = "Frames can be sent.", body = Health),
        NotReadyProblems
    )
)]
pub(super) async fn readyz(State(state): State<ApiState>) -> Result<Json<Health>, Problem> {
    match state.readiness.phase() {
        Phase::Ready => Ok(Json(Health { status: "ready" })),
        Phase::WarmingUp => Err(Problem::warming_up()),
        Phase::Stopping => Err(Problem::shutting_down()),
    }
}

/// Metrics in the Prometheus text format.
#[utoipa::path(
    get, path = "/metrics", tag = "operation", operation_id = "get_metrics",
    responses(
        (status = OK, description = "All metrics.", body = String, content_type = "text/plain"),
        FaultProblem
    )
)]
pub(super) async fn metrics(State(state): State<ApiState>) -> Result<impl IntoResponse, Problem> {
    let pending = i64::try_from(state.workers.pending()).unwrap_or(i64::MAX);
    state.metrics.pending_frames.set(pending);
    show_models(&state);
    let text = state.metrics.render().map_err(Problem::internal)?;
    Ok(([(CONTENT_TYPE, "text/plain; version=0.0.4")], text))
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

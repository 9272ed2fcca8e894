//! The shared state of the handlers.

use std::{
    ops::Deref,
    sync::Arc,
    time::{Duration, Instant},
};

use lookdown_detect::{
    fairness::SharedBudget,
    inference::ModelRepository,
    pipeline::{PipelineError, WorkerPool},
};
use lookdown_http::csrf::AllowedOrigins;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

use super::{
    companions::Companions,
    http::{
        access::Access,
        context::RequestContext,
        problem::{Problem, ProblemKind},
        rate_limit::RequestRate,
        request_body::{BodyReader, UploadBudget},
    },
};
use crate::{
    calibration_store::Calibrations,
    metrics::Metrics,
    reference_counts::ReferenceCounts,
    results::{Headline, ResultStore, StoredReport, Unreachable},
    settings::Settings,
    suggestions::Suggestions,
    telemetry::Tracer,
    views::Views,
};

/// Divisor of `max_upload_bytes` for the memory of bodies whose key has not been checked.
const UNAUTHENTICATED_SHARE: usize = 8;

/// The options of the API: the settings, and what was made of them.
#[derive(Clone)]
pub struct ApiOptions {
    /// The settings.
    pub settings: Arc<Settings>,
    /// The straight views of cameras.
    pub views: Arc<Views>,
    /// The access rules.
    pub access: Access,
    /// The cameras and counts of this process, and the counts of another host.
    pub companions: Companions,
    /// The reference counts of cameras.
    pub references: Arc<ReferenceCounts>,
    /// Creates the spans of requests.
    pub tracer: Tracer,
}

impl ApiOptions {
    /// The origins that may make changes; `None` if there are keys.
    pub(super) fn allowed_origins(&self) -> Option<AllowedOrigins> {
        self.access.allowed_origins(&self.settings.access)
    }

    /// The rate limit of each client; `None` for no limit.
    pub(super) fn request_rate(&self) -> Option<RequestRate> {
        let limits = &self.settings.limits;
        limits.requests_per_second.map(|per_second| RequestRate {
            per_second,
            burst: limits.request_burst,
        })
    }
}

/// The shared state of the handlers. Every layer clones it for every request, which only increments
/// a reference count.
#[derive(Clone)]
pub struct ApiState(Arc<Shared>);

/// The content of [`ApiState`].
pub struct Shared {
    pub(crate) workers: Arc<WorkerPool>,
    pub(crate) models: Arc<ModelRepository>,
    pub(crate) calibrations: Arc<Calibrations>,
    pub(crate) results: Arc<dyn ResultStore>,
    pub(crate) metrics: Arc<Metrics>,
    pub(crate) readiness: Readiness,
    pub(super) uploads: UploadBudget,
    /// The memory for bodies whose key has not been checked, apart from that of the others.
    pub(super) unauthenticated_uploads: UploadBudget,
    /// The memory for large responses that clients have not read yet.
    pub(super) responses: SharedBudget,
    /// The reference counts of cameras.
    pub(super) references: Arc<ReferenceCounts>,
    /// The calibrations that are found for cameras without one.
    pub(super) suggestions: Suggestions,
    /// The turns of fits that were asked for.
    pub(super) fits: FitTurns,
    pub(crate) options: ApiOptions,
}

impl ApiState {
    /// Creates the state around the workers.
    pub fn new(
        workers: Arc<WorkerPool>,
        models: Arc<ModelRepository>,
        calibrations: Arc<Calibrations>,
        results: Arc<dyn ResultStore>,
        metrics: Arc<Metrics>,
        readiness: Readiness,
        options: ApiOptions,
    ) -> Self {
        // An alert must see the first failure, so every counter exists from the start.
        for kind in ProblemKind::ALL {
            metrics.failures.with_label_values(&[kind.name()]);
        }
        let suggestions = Suggestions::new(
            Arc::clone(&calibrations),
            workers.engine().options.decode_limits,
            options.settings.calibrations.lens,
            options.settings.calibrations.apply_suggested,
            options.companions.own_cameras(),
        );
        Self(Arc::new(Shared {
            workers,
            models,
            calibrations,
            results,
            metrics,
            readiness,
            uploads: UploadBudget::new(
                options.settings.limits.max_upload_bytes,
                options.settings.server.max_body_bytes,
                "send fewer at a time, or retry",
            ),
            unauthenticated_uploads: UploadBudget::new(
                options.settings.limits.max_upload_bytes / UNAUTHENTICATED_SHARE,
                1,
                "send the key in a header, X-API-Key: KEY, or retry",
            ),
            responses: SharedBudget::new(options.settings.limits.max_upload_bytes),
            references: Arc::clone(&options.references),
            suggestions,
            fits: FitTurns::default(),
            options,
        }))
    }

    /// Returns true if the latest image of the camera is kept.
    pub(crate) fn keeps_image(&self, camera: &str) -> bool {
        let of_settings = self.options.settings.results.images_of.include(camera);
        let cameras = self.options.companions.cameras();
        of_settings || cameras.is_some_and(|cameras| cameras.keeps_image(camera))
    }

    /// Returns the headline number of the camera with this latest report.
    pub(super) async fn headline(&self, latest: &StoredReport) -> Result<Headline, Unreachable> {
        let companions = &self.options.companions;
        let (own, followed) = (companions.own_cameras(), companions.followed());
        Headline::for_latest(&*self.results, latest, &own, &followed, &self.references).await
    }

    /// Returns the problem while the server is not ready.
    pub(super) fn require_ready(&self) -> Result<(), Problem> {
        let limit = self.stall_limit();
        if let Some(stall) = self.workers.stall(Instant::now(), limit) {
            let seconds = stall.since.as_secs();
            let detail = format!(
                "no frame has made progress for {seconds} s: the log names them; restart the server \
                 if it stays so"
            );
            return Err(Problem::new(ProblemKind::Stalled, detail));
        }
        let remote = &self.models.remote;
        match self.readiness.phase() {
            Phase::Ready if remote.as_ref().is_none_or(|remote| remote.is_available()) => Ok(()),
            Phase::Ready => Err(PipelineError::InferenceUnavailable.into()),
            Phase::WarmingUp => Err(Problem::warming_up()),
            Phase::Stopping => Err(Problem::shutting_down()),
        }
    }

    /// Returns the time without progress of the workers after which the server is not ready. Each
    /// request ends within half of it.
    pub fn stall_limit(&self) -> Duration {
        self.options.settings.server.request_timeout * 2
    }

    /// Returns a reader of the body of a request, up to `max_bytes`; `remedy` is the advice for
    /// larger ones.
    pub(super) fn body_reader(
        &self,
        context: &RequestContext,
        max_bytes: usize,
        remedy: &'static str,
    ) -> BodyReader {
        BodyReader {
            max_bytes,
            remedy,
            budget: self.uploads.for_client(&context.caller.client),
            least_bytes_per_second: self.options.settings.limits.min_upload_bytes_per_second,
            deadline: context.deadline,
        }
    }
}

impl Deref for ApiState {
    type Target = Shared;

    fn deref(&self) -> &Shared {
        &self.0
    }
}

/// The phase of the server's life.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// The models have not run yet.
    WarmingUp,
    /// The server accepts frames.
    Ready,
    /// The server is shutting down and finishes the requests that have arrived.
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
    /// Marks the end of the warm-up. A server that is already stopping stays in that phase.
    pub fn warmed_up(&self) {
        self.0.send_if_modified(|phase| {
            let warming_up = *phase == Phase::WarmingUp;
            if warming_up {
                *phase = Phase::Ready;
            }
            warming_up
        });
    }

    /// Marks the beginning of the shutdown.
    pub fn stopping(&self) {
        self.0.send_replace(Phase::Stopping);
    }

    /// Returns the current phase.
    pub fn phase(&self) -> Phase {
        *self.0.borrow()
    }

    /// Waits for the end of the warm-up.
    pub async fn ready(&self) {
        // `self` holds the sender, so the channel stays open.
        let _ = self
            .0
            .subscribe()
            .wait_for(|phase| *phase != Phase::WarmingUp)
            .await;
    }
}

/// Fits that run or wait.
const PLACES: usize = 3;

/// The places and the turn.
pub(super) struct FitTurns {
    places: Arc<Semaphore>,
    turn: Arc<Semaphore>,
}

/// A turn, until it is dropped.
pub(super) struct FitTurn {
    _place: OwnedSemaphorePermit,
    _turn: OwnedSemaphorePermit,
}

impl Default for FitTurns {
    fn default() -> Self {
        Self {
            places: Arc::new(Semaphore::new(PLACES)),
            turn: Arc::new(Semaphore::new(1)),
        }
    }
}

impl FitTurns {
    /// Waits for the end of the fits before.
    ///
    /// # Errors
    /// [`ProblemKind::Overloaded`] at once if all places are taken.
    pub(super) async fn next(&self) -> Result<FitTurn, Problem> {
        let place = Arc::clone(&self.places).try_acquire_owned();
        let place = place.map_err(|_| {
            let detail = format!("{PLACES} fits run or wait: retry when they have ended");
            Problem::new(ProblemKind::Overloaded, detail)
        })?;
        let turn = Arc::clone(&self.turn).acquire_owned().await;
        Ok(FitTurn {
            _place: place,
            _turn: turn.map_err(|_| Problem::shutting_down())?,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::{
        future::Future,
        task::{Context, Poll, Waker},
    };

    use super::*;

    #[test]
    fn one_fit_runs_two_wait_and_a_fourth_is_refused() {
        let turns = FitTurns::default();
        let mut context = Context::from_waker(Waker::noop());
        let mut waiting = [(); 4].map(|()| Box::pin(turns.next()));
        let polled = waiting
            .each_mut()
            .map(|next| next.as_mut().poll(&mut context));
        let [
            Poll::Ready(Ok(running)),
            Poll::Pending,
            Poll::Pending,
            Poll::Ready(Err(refused)),
        ] = polled
        else {
            panic!("other turns");
        };
        assert_eq!(refused.kind, ProblemKind::Overloaded);
        drop(running);
        let second = waiting[1].as_mut().poll(&mut context);
        assert!(matches!(second, Poll::Ready(Ok(_))));
    }
}

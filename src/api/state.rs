//! The shared state of the handlers.

use std::{
    num::NonZeroU64,
    ops::Deref,
    sync::Arc,
    time::{Duration, Instant},
};

use lookdown_detect::{
    fairness::SharedBudget,
    inference::ModelRepository,
    parameters::DetectDefaults,
    pipeline::{PipelineError, WorkerPool},
};
use lookdown_http::{csrf::AllowedOrigins, header_limits::HeaderLimits};
use lookdown_imaging::{annotate::Concealment, decode::DecodeLimits};
use lookdown_lens::self_calibration::IdealLens;

use super::{
    companions::Companions,
    fit_turns::FitTurns,
    http::{
        access::Access,
        context::RequestContext,
        drain_body::BodyLimits,
        problem::{Problem, ProblemKind},
        rate_limit::RequestRate,
        request_body::{BodyReader, UploadBudget},
    },
    readiness::{Phase, Readiness},
};
use crate::{
    calibration_store::Calibrations,
    metrics::Metrics,
    reference_counts::ReferenceCounts,
    results::{Headline, ImagesOf, ResultStore, StoredReport, Unreachable},
    suggestions::Suggestions,
    telemetry::Tracer,
    views::Views,
};

/// Divisor of `max_upload_bytes` for the memory of bodies whose key has not been checked.
const UNAUTHENTICATED_SHARE: usize = 8;

/// The options of the API: access rules and limits.
#[derive(Clone)]
#[expect(clippy::struct_excessive_bools, reason = "independent settings")]
pub struct ApiOptions {
    /// Largest request body, bytes.
    pub max_body_bytes: usize,
    /// Largest sum of all request bodies, and of the tensors unpacked from them, in memory, bytes.
    pub max_upload_bytes: usize,
    /// Largest head of a request, bytes.
    pub max_header_bytes: usize,
    /// Largest number of headers of a request.
    pub max_headers: usize,
    /// The defaults of detection parameters.
    pub detect_defaults: DetectDefaults,
    /// `true` if the number of persons in each zone is a metric.
    pub zone_metrics: bool,
    /// `true` if the number of persons of each camera is a metric.
    pub camera_metrics: bool,
    /// The cameras whose latest image is stored.
    pub images_of: Arc<ImagesOf>,
    /// Longest time that these images are stored.
    pub image_age: Duration,
    /// The concealment of persons in these images.
    pub conceal_images: Option<Concealment>,
    /// The lens of cameras without a calibration, if it is known.
    pub lens: Option<IdealLens>,
    /// `true` if calibrations that are found for cameras without one are stored.
    pub apply_suggested_calibrations: bool,
    /// `true` if the metrics have a port of their own.
    pub metrics_elsewhere: bool,
    /// Longest duration of a request, from its first byte to its response.
    pub request_timeout: Duration,
    /// Least upload rate of a request body; `None` for no limit.
    pub min_upload_bytes_per_second: Option<NonZeroU64>,
    /// Rate limit of each client; `None` for no limit.
    pub request_rate: Option<RequestRate>,
    /// The straight views of cameras.
    pub views: Arc<Views>,
    /// The access rules.
    pub access: Access,
    /// Origins of web pages that may call the server from a browser.
    pub cors_origins: Vec<String>,
    /// Further names of a server without keys.
    pub hosts: Vec<String>,
    /// The cameras and counts of this process, and the counts of another host.
    pub companions: Companions,
    /// The reference counts of cameras.
    pub references: Arc<ReferenceCounts>,
    /// Creates the spans of requests.
    pub tracer: Tracer,
}

impl ApiOptions {
    /// The limits of request bodies.
    pub(super) fn body_limits(&self) -> BodyLimits {
        BodyLimits {
            max_body_bytes: self.max_body_bytes,
            min_upload_bytes_per_second: self.min_upload_bytes_per_second,
        }
    }

    /// The limits of request heads.
    pub(super) fn header_limits(&self) -> HeaderLimits {
        HeaderLimits {
            max_headers: self.max_headers,
            max_header_bytes: self.max_header_bytes,
        }
    }

    /// The origins that may make changes; `None` if there are keys.
    pub(super) fn allowed_origins(&self) -> Option<AllowedOrigins> {
        self.access.allowed_origins(&self.cors_origins, &self.hosts)
    }

    /// Returns the time without progress of the workers after which the server is not ready. Each
    /// request ends within half of it.
    pub fn stall_limit(&self) -> Duration {
        self.request_timeout * 2
    }

    /// Options for tests: small bodies, and no access control.
    pub fn for_testing() -> Self {
        Self {
            max_body_bytes: 1 << 20,
            max_upload_bytes: 1 << 24,
            max_header_bytes: 4096,
            max_headers: 32,
            detect_defaults: DetectDefaults::default(),
            zone_metrics: false,
            camera_metrics: false,
            images_of: Arc::default(),
            image_age: Duration::from_hours(24),
            conceal_images: None,
            lens: None,
            apply_suggested_calibrations: false,
            metrics_elsewhere: false,
            request_timeout: Duration::from_secs(20),
            min_upload_bytes_per_second: None,
            request_rate: None,
            views: Arc::new(Views::new("state".into(), DecodeLimits::default(), None)),
            access: Access::Open {
                own_machine_only: true,
            },
            cors_origins: Vec::new(),
            hosts: Vec::new(),
            companions: Companions::default(),
            references: Arc::default(),
            tracer: Tracer::default(),
        }
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
            options.lens,
            options.apply_suggested_calibrations,
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
                options.max_upload_bytes,
                options.max_body_bytes,
                "send fewer at a time, or retry",
            ),
            unauthenticated_uploads: UploadBudget::new(
                options.max_upload_bytes / UNAUTHENTICATED_SHARE,
                1,
                "send the key in a header, X-API-Key: KEY, or retry",
            ),
            responses: SharedBudget::new(options.max_upload_bytes),
            references: Arc::clone(&options.references),
            suggestions,
            fits: FitTurns::default(),
            options,
        }))
    }

    /// Returns true if the latest image of the camera is kept.
    pub(super) fn keeps_image(&self, camera: &str) -> bool {
        let of_settings = self.options.images_of.include(camera);
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
        let limit = self.options.stall_limit();
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

    /// Returns the time without progress of the workers after which the server is not ready.
    pub fn stall_limit(&self) -> Duration {
        self.options.stall_limit()
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
            least_bytes_per_second: self.options.min_upload_bytes_per_second,
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

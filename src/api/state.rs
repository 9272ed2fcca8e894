//! What the handlers share.

use std::{num::NonZeroU64, ops::Deref, sync::Arc, time::Duration};

use super::{
    Access, Readiness, RequestRate,
    deadline::Deadline,
    problem::ProblemKind,
    upload::{BodyReader, UploadBudget},
};
use crate::{
    calibration::Calibrations,
    inference::ModelRepository,
    metrics::Metrics,
    pipeline::WorkerPool,
    results::{PicturesOf, ResultStore},
    telemetry::Tracer,
};

/// Bodies whose key is not known yet may hold one part in so many of `max_upload_bytes`.
const UNAUTHENTICATED_SHARE: usize = 8;

/// Who may do what, and what a request may cost.
#[derive(Debug, Clone)]
pub struct ApiOptions {
    /// Largest request body, bytes.
    pub max_body_bytes: usize,
    /// Most bytes that all request bodies, and tensors unpacked from them, may hold in memory together.
    pub max_upload_bytes: usize,
    /// Most bytes of a request's head.
    pub max_header_bytes: usize,
    /// Most headers of a request.
    pub max_headers: usize,
    /// Whether the persons in each zone are shown as a metric.
    pub zone_metrics: bool,
    /// The cameras whose latest picture is kept.
    pub pictures_of: Arc<PicturesOf>,
    /// Whether metrics are on a port of their own, and not among the other routes.
    pub metrics_elsewhere: bool,
    /// Longest a request may take, from its first byte to its answer.
    pub request_timeout: Duration,
    /// A body that comes more slowly is given up; `None` for none.
    pub min_upload_bytes_per_second: Option<NonZeroU64>,
    /// How often a client may ask; `None` for as often as it wants.
    pub request_rate: Option<RequestRate>,
    /// Who may do what.
    pub access: Access,
    /// Origins of web pages that may call the server from a browser.
    pub cors_origins: Vec<String>,
    /// Makes the spans of requests.
    pub tracer: Tracer,
}

impl ApiOptions {
    /// Options for tests: small bodies, and every client may do everything.
    #[must_use]
    pub fn for_testing() -> Self {
        Self {
            max_body_bytes: 1 << 20,
            max_upload_bytes: 1 << 24,
            max_header_bytes: 4096,
            max_headers: 32,
            zone_metrics: false,
            pictures_of: Arc::default(),
            metrics_elsewhere: false,
            request_timeout: Duration::from_secs(20),
            min_upload_bytes_per_second: None,
            request_rate: None,
            access: Access::Open {
                own_machine_only: true,
            },
            cors_origins: Vec::new(),
            tracer: Tracer::default(),
        }
    }
}

/// What the handlers share. Every layer of every request clones it: one count goes up, whatever is in it.
#[derive(Clone)]
pub struct ApiState(Arc<Shared>);

/// What is in it.
pub struct Shared {
    pub(super) workers: Arc<WorkerPool>,
    pub(super) models: Arc<ModelRepository>,
    pub(super) calibrations: Arc<Calibrations>,
    pub(super) results: Arc<dyn ResultStore>,
    pub(super) metrics: Arc<Metrics>,
    pub(super) readiness: Readiness,
    pub(super) uploads: UploadBudget,
    /// The memory of bodies whose key is not known yet: they cannot take that of the others.
    pub(super) unauthenticated_uploads: UploadBudget,
    pub(super) options: ApiOptions,
}

impl ApiState {
    /// A state around the workers that answer.
    #[must_use]
    pub fn new(
        workers: Arc<WorkerPool>,
        models: Arc<ModelRepository>,
        calibrations: Arc<Calibrations>,
        results: Arc<dyn ResultStore>,
        metrics: Arc<Metrics>,
        readiness: Readiness,
        options: ApiOptions,
    ) -> Self {
        // An alert must see the first failure, too: every counter is there from the start.
        for kind in ProblemKind::ALL {
            metrics.failures.with_label_values(&[kind.name()]);
        }
        Self(Arc::new(Shared {
            workers,
            models,
            calibrations,
            results,
            metrics,
            readiness,
            uploads: UploadBudget::new(options.max_upload_bytes, "send fewer at a time, or retry"),
            unauthenticated_uploads: UploadBudget::new(
                options.max_upload_bytes / UNAUTHENTICATED_SHARE,
                "send the key in a header, X-API-Key: KEY, or retry",
            ),
            options,
        }))
    }

    /// Reads bodies of up to `max_bytes`; `remedy` says what to do about larger ones.
    pub(super) fn body_reader(
        &self,
        max_bytes: usize,
        remedy: &'static str,
        deadline: Deadline,
    ) -> BodyReader<'_> {
        BodyReader {
            max_bytes,
            remedy,
            budget: &self.uploads,
            least_bytes_per_second: self.options.min_upload_bytes_per_second,
            deadline,
        }
    }
}

impl Deref for ApiState {
    type Target = Shared;

    fn deref(&self) -> &Shared {
        &self.0
    }
}

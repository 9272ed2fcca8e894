//! Fuzzes HTTP requests to the whole service: query, headers, multipart, JSON, calibration bodies.
//!
//! The stub detector finds no persons, and the store discards writes, so that every request runs
//! against the same state.

use std::{
    num::NonZeroUsize,
    sync::{Arc, LazyLock},
};

use axum::{
    Router,
    body::Body,
    http::{
        HeaderName, HeaderValue, Method, Request, StatusCode, Uri,
        header::{CONTENT_TYPE, HOST},
    },
};
use http_body_util::BodyExt;
use lookdown::{
    api::{self, Access, ApiOptions, ApiState, Companions, Readiness},
    calibration_store::{CalibrationStore, Calibrations, ListedFile, Replaces, StoreError},
    metrics::Metrics,
    results::{MemoryResults, ResultLimits, ResultStore},
    settings::load,
    telemetry::Tracer,
    views::Views,
};
use lookdown_detect::{
    inference::{
        Detector, HeadOutput, InferenceError, Model, ModelFolder, ModelRepository,
        RepositoryOptions,
    },
    pipeline::{Engine, EngineOptions, WorkerPool},
};
use lookdown_imaging::{NetworkInput, ViewBatch, decode::DecodeLimits};
use tokio::runtime::{self, Runtime};
use tower::ServiceExt;

/// The name of the model in seeds and corpora.
const MODEL: &str = "silent";
const LOBBY: &str = r#"{ "id": "lobby", "image": {"width": 200, "height": 200},
  "lens": {"model": "equidistant", "focal": 63.66, "cx": 99.5, "cy": 99.5, "max_theta": 1.5707} }"#;
/// The maximum side of images; larger ones are refused early, which keeps requests fast.
const MAX_IMAGE_SIDE: u32 = 32;

static SERVICE: LazyLock<(Runtime, Router)> = LazyLock::new(|| {
    let runtime = runtime::Builder::new_current_thread().enable_time().build();
    (runtime.unwrap(), router())
});

/// Answers the request that `bytes` encode; returns true if they encode one.
pub fn read(bytes: &[u8]) -> bool {
    let Some(request) = request(bytes) else {
        return false;
    };
    let (runtime, router) = &*SERVICE;
    let path = request.uri().clone();
    let (parts, body) = runtime.block_on(async {
        let response = router.clone().oneshot(request).await;
        let (parts, body) = response.unwrap().into_parts();
        (parts, body.collect().await.unwrap().to_bytes())
    });
    assert_ne!(parts.status, StatusCode::INTERNAL_SERVER_ERROR, "{path}");
    if parts.status.is_client_error() {
        assert_eq!(
            parts.headers[CONTENT_TYPE], "application/problem+json",
            "{path}"
        );
        if !body.is_empty() {
            let problem: serde_json::Value = serde_json::from_slice(&body).unwrap();
            assert_eq!(problem["status"], parts.status.as_u16(), "{path}");
        }
    }
    true
}

/// `METHOD /path?query`, headers `name: value`, an empty line and the body; lines end with `\n`.
fn request(bytes: &[u8]) -> Option<Request<Body>> {
    let (first, mut rest) = line(bytes)?;
    let mut words = first.splitn(2, |byte| *byte == b' ');
    let method = Method::from_bytes(words.next()?).ok()?;
    let uri = Uri::try_from(words.next()?).ok()?;
    let mut request = Request::new(Body::empty());
    *request.method_mut() = method;
    *request.uri_mut() = uri;
    loop {
        let (header, after) = line(rest)?;
        rest = after;
        if header.is_empty() {
            break;
        }
        let colon = header.iter().position(|byte| *byte == b':')?;
        let name = HeaderName::from_bytes(&header[..colon]).ok()?;
        let value = HeaderValue::from_bytes(header[colon + 1..].trim_ascii()).ok()?;
        request.headers_mut().append(name, value);
    }
    // Every client sends a Host; one in the input is kept.
    let host = request.headers_mut().entry(HOST);
    host.or_insert(HeaderValue::from_static("localhost"));
    *request.body_mut() = Body::from(rest.to_vec());
    Some(request)
}

fn line(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    Some((&bytes[..end], &bytes[end + 1..]))
}

fn router() -> Router {
    let one = NonZeroUsize::MIN;
    let metrics = Arc::<Metrics>::default();
    let models = ModelRepository::new(
        RepositoryOptions {
            folder: ModelFolder {
                path: "/nowhere".into(),
                elsewhere: Some((MODEL.to_owned(), MODEL.into())),
            },
            warm_up_views: one,
            explain: ToString::to_string,
        },
        Box::new(|_| Ok(Model::new(Box::new(Silent(NetworkInput::plain(16, 16)))))),
        Arc::clone(&metrics.detect),
    );
    models.load(MODEL).unwrap();
    let calibrations = Arc::new(
        Calibrations::open(Box::new(DiscardingStore), true, Arc::clone(&metrics)).unwrap(),
    );
    let options = EngineOptions {
        decode_limits: DecodeLimits {
            max_width: MAX_IMAGE_SIDE,
            max_height: MAX_IMAGE_SIDE,
            ..DecodeLimits::default()
        },
        rig_cache_bytes: 1 << 24,
        ..EngineOptions::for_testing(MODEL)
    };
    let registry = Arc::clone(&models.registry);
    let engine = Engine::new(
        registry,
        Some(calibrations.clone()),
        options,
        Arc::clone(&metrics.detect),
    )
    .unwrap();
    let workers = WorkerPool::start(&Arc::new(engine), one, one).unwrap();
    let readiness = Readiness::default();
    readiness.warmed_up();
    let results = MemoryResults::new(ResultLimits::default(), Arc::clone(&metrics));
    // Ends event streams and waits for reports at once.
    results.listeners().end();
    let mut settings = load(None, []).unwrap_or_else(|error| panic!("{error}"));
    settings.server.max_body_bytes = 1 << 16;
    settings.limits.max_upload_bytes = 1 << 20;
    settings.limits.min_upload_bytes_per_second = None;
    api::router(ApiState::new(
        Arc::new(workers),
        Arc::new(models),
        calibrations,
        Arc::new(results),
        metrics,
        readiness,
        ApiOptions {
            settings: Arc::new(settings),
            views: Arc::new(Views::new("state".into(), DecodeLimits::default(), None)),
            access: Access::Open {
                own_machine_only: true,
            },
            companions: Companions::default(),
            references: Arc::default(),
            tracer: Tracer::default(),
        },
    ))
}

/// A detector that finds no persons.
struct Silent(NetworkInput);

impl Detector for Silent {
    fn name(&self) -> &'static str {
        MODEL
    }

    fn revision(&self) -> &'static str {
        "1"
    }

    fn input(&self) -> &NetworkInput {
        &self.0
    }

    fn detect(&mut self, batch: &ViewBatch) -> Result<HeadOutput, InferenceError> {
        Ok(HeadOutput {
            per_view: vec![Vec::new(); batch.views()],
            non_finite: 0,
        })
    }
}

/// Holds one calibration, and discards writes.
#[derive(Debug)]
struct DiscardingStore;

impl CalibrationStore for DiscardingStore {
    fn place(&self) -> String {
        "memory".to_owned()
    }

    fn list(&self) -> Result<Vec<ListedFile>, StoreError> {
        Ok(vec![ListedFile {
            name: "lobby.json".to_owned(),
            stamp: String::new(),
        }])
    }

    fn read(&self, _name: &str, _at_most: usize) -> Result<Vec<u8>, StoreError> {
        Ok(LOBBY.as_bytes().to_vec())
    }

    fn write(
        &self,
        _name: &str,
        _content: &[u8],
        _replaces: Replaces<'_>,
    ) -> Result<(), StoreError> {
        Ok(())
    }

    fn delete(&self, _name: &str) -> Result<(), StoreError> {
        Ok(())
    }
}

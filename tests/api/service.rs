//! The service under test and its clients.

use std::{
    num::{NonZeroU64, NonZeroUsize},
    sync::Arc,
    time::Duration,
};

use axum::{
    Router,
    body::Body,
    http::{
        HeaderMap, HeaderValue, Request, StatusCode,
        header::{CONTENT_TYPE, HOST},
    },
};
use http_body_util::BodyExt;
use lookdown::{
    api::{self, Access, ApiOptions, ApiState, Companions, Readiness, RequestRate},
    app::Assembly,
    calibration_store::{Calibrations, FolderStore},
    metrics::Metrics,
    results::{ImagesOf, MemoryResults, ResultLimits, ResultStore},
    settings::{Settings, explain, load},
    telemetry::Tracer,
    views::Views,
};
use lookdown_detect::{
    inference::{InferenceError, Model, ModelFolder, ModelRepository, RepositoryOptions},
    parameters::DetectDefaults,
    pipeline::{Engine, EngineOptions, WorkerPool},
};
use lookdown_imaging::{
    Frame, NetworkInput,
    annotate::{Concealment, encode_png},
    decode::DecodeLimits,
};
use serde_json::Value;
use tempfile::TempDir;
use tower::ServiceExt;

use crate::detector::{EagerDetector, Gate};

/// Sides of the frames that [`frame`] makes, and that `lobby` is calibrated for.
pub(crate) const FRAME_SIDE: u32 = 200;
const LOBBY: &str = r#"{ "id": "lobby", "image": {"width": 200, "height": 200},
  "lens": {"model": "equidistant", "focal": 63.66, "cx": 99.5, "cy": 99.5, "max_theta": 1.5707},
  "mount": {"world_up": [0, 0, -1], "height_m": 3} }"#;
/// The routes that are always open to all clients.
pub(crate) const OPEN_PATHS: [&str; 12] = [
    "/livez",
    "/readyz",
    "/metrics",
    "/openapi.json",
    "/docs/",
    "/",
    "/v2",
    "/v2/health/live",
    "/v2/health/ready",
    "/v1/status/ping",
    "/v1/server/status/ping",
    "/v1/status/updateavailable",
];
const BOUNDARY: &str = "edge-of-a-part";

/// A running service without a socket.
pub(crate) struct Service {
    pub(crate) router: Router,
    pub(crate) gate: Arc<Gate>,
    pub(crate) readiness: Readiness,
    pub(crate) calibrations: Arc<Calibrations>,
    pub(crate) results: Arc<MemoryResults>,
    pub(crate) metrics: Arc<Metrics>,
    /// The calibration `lobby`, and models in `models/`. Removed at the end of the test.
    pub(crate) folder: TempDir,
}

/// The limits that a test may lower.
pub(crate) struct Bounds {
    pub(crate) frames_in_flight: usize,
    pub(crate) max_body_bytes: usize,
    pub(crate) max_upload_bytes: usize,
    pub(crate) request_timeout: Duration,
    pub(crate) min_upload_bytes_per_second: Option<NonZeroU64>,
    pub(crate) request_rate: Option<RequestRate>,
    pub(crate) results: ResultLimits,
    pub(crate) detect_defaults: DetectDefaults,
    pub(crate) zone_metrics: bool,
    pub(crate) camera_metrics: bool,
    pub(crate) images_of: ImagesOf,
    pub(crate) conceal_images: Option<Concealment>,
    pub(crate) access: Access,
    pub(crate) cors_origins: Vec<String>,
    pub(crate) hosts: Vec<String>,
    pub(crate) companions: Companions,
    pub(crate) tracer: Tracer,
}

impl Default for Bounds {
    fn default() -> Self {
        Self {
            frames_in_flight: 8,
            max_body_bytes: 1 << 20,
            max_upload_bytes: 1 << 24,
            request_timeout: Duration::from_secs(20),
            min_upload_bytes_per_second: NonZeroU64::new(1024),
            request_rate: None,
            results: ResultLimits::default(),
            detect_defaults: DetectDefaults::default(),
            zone_metrics: false,
            camera_metrics: false,
            images_of: ImagesOf::default(),
            conceal_images: None,
            access: Access::Open {
                own_machine_only: true,
            },
            cors_origins: Vec::new(),
            hosts: Vec::new(),
            companions: Companions::default(),
            tracer: Tracer::default(),
        }
    }
}

impl Bounds {
    fn settings(&self) -> Settings {
        let mut settings = load(None, []).unwrap();
        settings.server.max_body_bytes = self.max_body_bytes;
        settings.server.request_timeout = self.request_timeout;
        settings.connections.max_header_bytes = 4096;
        settings.connections.max_headers = 32;
        settings.limits.max_upload_bytes = self.max_upload_bytes;
        settings.limits.min_upload_bytes_per_second = self.min_upload_bytes_per_second;
        settings.limits.requests_per_second = self.request_rate.map(|rate| rate.per_second);
        if let Some(rate) = self.request_rate {
            settings.limits.request_burst = rate.burst;
        }
        settings.access.cors_origins.clone_from(&self.cors_origins);
        settings.access.hosts.clone_from(&self.hosts);
        settings.calibrations.zone_metrics = self.zone_metrics;
        settings.detect = self.detect_defaults.clone();
        settings.results.camera_metrics = self.camera_metrics;
        settings.results.images_of = self.images_of.clone();
        settings.results.conceal_images = self.conceal_images;
        settings
    }
}

/// A response, read to its end if it has one.
pub(crate) struct Answer {
    pub(crate) status: StatusCode,
    pub(crate) headers: HeaderMap,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap()
    }

    pub(crate) fn text(&self) -> String {
        String::from_utf8(self.body.clone()).unwrap()
    }

    pub(crate) fn header(&self, name: &str) -> &str {
        self.headers[name].to_str().unwrap()
    }

    /// Returns the problem document and checks its members.
    pub(crate) fn problem(&self) -> Value {
        assert_eq!(self.header("content-type"), "application/problem+json");
        let problem = self.json();
        assert_eq!(problem["status"], self.status.as_u16());
        assert_eq!(problem["error"], problem["detail"]);
        assert_eq!(problem["request_id"], self.header("x-request-id"));
        let instance = problem["instance"].as_str().unwrap();
        assert!(instance.starts_with("urn:uuid:"), "{instance}");
        assert!(!problem["title"].as_str().unwrap().is_empty());
        let kind = problem["type"].as_str().unwrap();
        assert!(kind.starts_with("/problems/"), "{kind}");
        problem
    }
}

/// An engine with the fake detector, not loaded yet, and the calibration `lobby`.
pub(crate) fn assembly(gate: &Arc<Gate>) -> (Assembly, TempDir) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lobby.json"), LOBBY).unwrap();
    let gate = Arc::clone(gate);
    let one_view = NonZeroUsize::MIN;
    let metrics = Arc::<Metrics>::default();
    let models = ModelRepository::new(
        RepositoryOptions {
            folder: ModelFolder {
                path: folder.path().join("models"),
                elsewhere: Some(("eager".to_owned(), "eager".into())),
            },
            warm_up_views: one_view,
            explain,
        },
        Box::new(move |path| {
            if path.join("broken").exists() {
                return Err(InferenceError::Unusable {
                    path: path.to_owned(),
                    problem: "it is broken".to_owned(),
                });
            }
            let name = path.file_name().unwrap().to_str().unwrap();
            let detector = EagerDetector {
                name: name.to_owned(),
                input: NetworkInput::plain(64, 64),
                gate: Arc::clone(&gate),
            };
            Ok(Model::new(Box::new(detector)))
        }),
        Arc::clone(&metrics.detect),
    );
    let options = EngineOptions::for_testing("eager");
    let store = Box::new(FolderStore::new(folder.path()));
    let calibrations = Arc::new(Calibrations::open(store, true, Arc::clone(&metrics)).unwrap());
    let registry = Arc::clone(&models.registry);
    let known = Arc::clone(&calibrations);
    let engine = Engine::new(registry, Some(known), options, Arc::clone(&metrics.detect)).unwrap();
    let models = Arc::new(models);
    let assembly = Assembly {
        engine,
        calibrations,
        models,
        metrics,
    };
    (assembly, folder)
}

impl Service {
    pub(crate) fn start() -> Self {
        Self::within(&Bounds::default())
    }

    /// A warm service with one worker and these limits.
    pub(crate) fn within(bounds: &Bounds) -> Self {
        let gate = Arc::new(Gate::default());
        let (assembly, folder) = assembly(&gate);
        Self::around(assembly, folder, gate, bounds)
    }

    /// A warm service with one worker around an assembly.
    pub(crate) fn around(
        assembly: Assembly,
        folder: TempDir,
        gate: Arc<Gate>,
        bounds: &Bounds,
    ) -> Self {
        let Assembly {
            engine,
            calibrations,
            models,
            metrics,
        } = assembly;
        models.load("eager").unwrap();
        gate.forget_runs();
        let capacity = NonZeroUsize::new(bounds.frames_in_flight).unwrap();
        let workers = WorkerPool::start(&Arc::new(engine), NonZeroUsize::MIN, capacity).unwrap();
        let readiness = Readiness::default();
        readiness.warmed_up();
        let results = Arc::new(MemoryResults::new(bounds.results, Arc::clone(&metrics)));
        let state = ApiState::new(
            Arc::new(workers),
            models,
            Arc::clone(&calibrations),
            Arc::clone(&results) as Arc<dyn ResultStore>,
            Arc::clone(&metrics),
            readiness.clone(),
            ApiOptions {
                views: Arc::new(Views::new(
                    folder.path().join("state"),
                    DecodeLimits::default(),
                    bounds.conceal_images,
                )),
                access: bounds.access.clone(),
                companions: bounds.companions.clone(),
                references: Arc::default(),
                tracer: bounds.tracer.clone(),
                settings: Arc::new(bounds.settings()),
            },
        );
        Self {
            router: api::router(state),
            gate,
            readiness,
            calibrations,
            results,
            metrics,
            folder,
        }
    }

    /// Sends a request to `path`; detection routes get a frame.
    pub(crate) async fn ask(&self, method: &str, path: &str, headers: &[(&str, &str)]) -> Answer {
        let mut request = Request::builder().method(method).uri(path);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let body = if path.starts_with("/detect") {
            Body::from(frame())
        } else {
            Body::empty()
        };
        self.send(request.body(body).unwrap()).await
    }

    pub(crate) async fn send(&self, request: Request<Body>) -> Answer {
        let response = self.router.clone().oneshot(with_host(request)).await;
        let response = response.unwrap();
        let (parts, mut body) = response.into_parts();
        let content_type = parts.headers.get(CONTENT_TYPE);
        if content_type.is_some_and(|kind| kind == "text/event-stream") {
            body = Body::empty();
        }
        Answer {
            status: parts.status,
            headers: parts.headers,
            body: body.collect().await.unwrap().to_bytes().to_vec(),
        }
    }

    pub(crate) async fn get(&self, path: &str) -> Answer {
        self.send(Request::get(path).body(Body::empty()).unwrap())
            .await
    }

    pub(crate) async fn put(&self, path: &str, body: &str) -> Answer {
        let body = Body::from(body.to_owned());
        self.send(Request::put(path).body(body).unwrap()).await
    }

    pub(crate) async fn patch(&self, path: &str, body: &str) -> Answer {
        let body = Body::from(body.to_owned());
        self.send(Request::patch(path).body(body).unwrap()).await
    }

    pub(crate) async fn post(&self, path: &str, body: &str) -> Answer {
        let body = Body::from(body.to_owned());
        self.send(Request::post(path).body(body).unwrap()).await
    }

    /// Sends a form; a part is a name, optionally with `; filename=…`, and its content.
    pub(crate) async fn post_form(&self, parts: &[(&str, &[u8])]) -> Answer {
        self.send(form(parts)).await
    }

    /// Sends a body with parameters in the query.
    pub(crate) async fn post_raw(&self, query: &str, body: Vec<u8>) -> Answer {
        let path = format!("/detect?{query}");
        self.send(Request::post(path).body(Body::from(body)).unwrap())
            .await
    }

    /// Asserts that a valid request still succeeds.
    pub(crate) async fn still_works(&self) {
        let answer = self
            .post_raw("calibration=lobby&profile=fast", frame())
            .await;
        assert_eq!(answer.status, StatusCode::OK, "{}", answer.text());
    }
}

/// The request with the `Host` header that every HTTP client sends.
pub(crate) fn with_host(mut request: Request<Body>) -> Request<Body> {
    let host = request.headers_mut().entry(HOST);
    host.or_insert(HeaderValue::from_static("localhost"));
    request
}

/// A form for `/detect`.
pub(crate) fn form(parts: &[(&str, &[u8])]) -> Request<Body> {
    let mut body = Vec::new();
    for (name, content) in parts {
        let head =
            format!("--{BOUNDARY}\r\nContent-Disposition: form-data; name=\"{name}\"\r\n\r\n");
        body.extend_from_slice(head.as_bytes());
        body.extend_from_slice(content);
        body.extend_from_slice(b"\r\n");
    }
    body.extend_from_slice(format!("--{BOUNDARY}--\r\n").as_bytes());
    Request::post("/detect")
        .header(
            CONTENT_TYPE,
            format!("multipart/form-data; boundary={BOUNDARY}"),
        )
        .body(Body::from(body))
        .unwrap()
}

/// The same form for another path.
pub(crate) fn form_to(path: &str, parts: &[(&str, &[u8])]) -> Request<Body> {
    let mut request = form(parts);
    *request.uri_mut() = path.parse().unwrap();
    request
}

/// A gray PNG that fits the calibration `lobby`.
pub(crate) fn frame() -> Vec<u8> {
    frame_of(FRAME_SIDE, FRAME_SIDE)
}

pub(crate) fn frame_of(width: u32, height: u32) -> Vec<u8> {
    let pixels = vec![128; 3 * width as usize * height as usize];
    encode_png(&Frame::new(width, height, pixels).unwrap()).unwrap()
}

/// A PNG with about three bytes per pixel.
pub(crate) fn incompressible_frame() -> Vec<u8> {
    let mut state = 1_u32;
    let noise = std::iter::repeat_with(|| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state.to_be_bytes()[0]
    });
    let pixels = noise.take(3 * (FRAME_SIDE * FRAME_SIDE) as usize).collect();
    encode_png(&Frame::new(FRAME_SIDE, FRAME_SIDE, pixels).unwrap()).unwrap()
}

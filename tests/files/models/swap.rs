//! Replacement of a model under load.

use std::{
    collections::BTreeSet,
    fs,
    num::NonZeroUsize,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use axum::{
    Router,
    body::Body,
    http::{Request, StatusCode},
};
use http_body_util::BodyExt;
use lookdown::{
    api::{self, Access, ApiOptions, ApiState, Companions, Readiness},
    calibration_store::{Calibrations, FolderStore},
    metrics::Metrics,
    results::{MemoryResults, ResultLimits},
    settings::{explain, load},
    telemetry::Tracer,
    views::Views,
};
use lookdown_detect::{
    inference::{ModelFolder, ModelRepository, RepositoryOptions},
    pipeline::{Engine, EngineOptions, WorkerPool},
};
use lookdown_imaging::decode::DecodeLimits;
use serde_json::Value;
use tempfile::TempDir;
use tokio::task::spawn_blocking;
use tower::ServiceExt;

use crate::models::folder::{in_repository, model_of_two_sessions, write};

const CLIENTS: usize = 3;
const SWAPS: usize = 6;

/// A service whose only model is called `person`, and its models.
fn service(folder: &Path) -> (Router, Arc<ModelRepository>) {
    let two = NonZeroUsize::new(2).unwrap();
    let metrics = Arc::<Metrics>::default();
    let models = ModelRepository::new(
        RepositoryOptions {
            folder: ModelFolder {
                path: folder.to_owned(),
                elsewhere: None,
            },
            warm_up_views: two,
            explain,
        },
        Box::new(model_of_two_sessions),
        Arc::clone(&metrics.detect),
    );
    models.load("person").unwrap();
    let engine = EngineOptions {
        sessions: two,
        remap_threads: two,
        ..EngineOptions::for_testing("person")
    };
    let engine = Engine::new(
        Arc::clone(&models.registry),
        None,
        engine,
        Arc::clone(&metrics.detect),
    )
    .unwrap();
    let workers = WorkerPool::start(&Arc::new(engine), two, NonZeroUsize::new(16).unwrap());
    let readiness = Readiness::default();
    readiness.warmed_up();
    let mut settings = load(None, []).unwrap();
    settings.limits.min_upload_bytes_per_second = None;
    settings.server.request_timeout = Duration::from_mins(2);
    let options = ApiOptions {
        settings: Arc::new(settings),
        views: Arc::new(Views::new(
            folder.join("state"),
            DecodeLimits::default(),
            None,
        )),
        access: Access::Open {
            own_machine_only: true,
        },
        companions: Companions::default(),
        references: Arc::default(),
        tracer: Tracer::default(),
    };
    let store = FolderStore::that_may_be_missing(&folder.join("calibrations"));
    let calibrations = Calibrations::open(Box::new(store), false, Arc::clone(&metrics)).unwrap();
    let workers = Arc::new(workers.unwrap());
    let models = Arc::new(models);
    let router = api::router(ApiState::new(
        workers,
        Arc::clone(&models),
        Arc::new(calibrations),
        Arc::new(MemoryResults::new(
            ResultLimits::default(),
            Arc::clone(&metrics),
        )),
        metrics,
        readiness,
        options,
    ));
    (router, models)
}

async fn post(router: &Router, path: &str, body: Vec<u8>) -> (StatusCode, Value) {
    let request = Request::post(path).header("host", "localhost");
    let request = request.body(Body::from(body)).unwrap();
    let response = router.clone().oneshot(request).await.unwrap();
    let status = response.status();
    let body = response.into_body().collect().await.unwrap().to_bytes();
    (status, serde_json::from_slice(&body).unwrap())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_model_is_swapped_under_load_without_a_failed_request() {
    let folder = TempDir::new().unwrap();
    let person = folder.path().join("person");
    let weights = ["nanodet_g_views_416", "nanodet_g_views_416_fp16"]
        .map(|name| in_repository(&format!("models/{name}/model.onnx")));
    write(&person, "person", "", &weights[0]);
    let (router, models) = service(folder.path());
    let frame = fs::read(in_repository("samples/office.jpg")).unwrap();

    let done = Arc::new(AtomicBool::new(false));
    let clients = (0..CLIENTS).map(|_| {
        let (router, frame, done) = (router.clone(), frame.clone(), Arc::clone(&done));
        tokio::spawn(async move {
            let mut seen = Vec::new();
            while !done.load(Ordering::Relaxed) {
                let (status, report) = post(&router, "/detect?profile=fast", frame.clone()).await;
                assert_eq!(status, StatusCode::OK, "{report}");
                assert_eq!(report["model"]["name"], "person");
                assert_ne!(report["persons"], Value::Array(Vec::new()));
                seen.push(report["model"]["revision"].as_str().unwrap().to_owned());
            }
            seen
        })
    });
    let clients: Vec<_> = clients.collect();

    let mut revisions = BTreeSet::new();
    for swap in 1..=SWAPS {
        write(&person, "person", "", &weights[swap % 2]);
        let reloading = Arc::clone(&models);
        // The files must be unchanged between two checks.
        let reload = move || (0..2).for_each(|_| reloading.reload_changed());
        spawn_blocking(reload).await.unwrap();
        let revision = models.registry.get("person").unwrap().revision.clone();
        // A frame that starts now uses the new model.
        let (_, report) = post(&router, "/detect?profile=fast", frame.clone()).await;
        assert_eq!(report["model"]["revision"], revision.as_str());
        revisions.insert(revision);
    }
    done.store(true, Ordering::Relaxed);
    assert_eq!(revisions.len(), 2);
    let mut seen = BTreeSet::new();
    for client in clients {
        seen.extend(client.await.unwrap());
    }
    assert_eq!(
        seen, revisions,
        "a report names an unknown revision, or no reports were received"
    );
}

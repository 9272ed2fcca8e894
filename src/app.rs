//! The composition root: settings → engine → workers → service.
//!
//! The models that the settings describe.

mod pollers;
mod serving;

use std::{path::Path, sync::Arc, time::Duration};

use anyhow::{Context, anyhow};
use jiff::Timestamp;
use lookdown_common::{InProcess, OwnCameras, ServerClient, ServerOptions};
use lookdown_count::{PersonsByCamera, read_persons};
use lookdown_detect::{
    inference::{
        CandidateOptions, Model, ModelFolder, ModelLoader, ModelManifest, ModelRepository,
        OnnxOptions, RemoteDetector, RemoteOptions, RemoteServer, RepositoryOptions, onnx_loader,
    },
    metrics::DetectMetrics,
    parameters::DetectParameters,
    pipeline::{BatchOptions, DefaultModels, Engine, EngineOptions, WorkerPool},
};
use lookdown_imaging::decode::DecodeLimits;
use tokio::sync::watch;

pub use pollers::Reloader;
pub use serving::Sockets;

use crate::{
    access::AccessKeys,
    api::{self, Access, ApiOptions, ApiState, Companions, Readiness},
    calibration_store::{Calibrations, FolderStore},
    cameras::Cameras,
    metrics::Metrics,
    mqtt::Publisher,
    reference_counts::ReferenceCounts,
    results::{MemoryResults, RedisResults, ResultStore},
    settings::{
        AccessSettings, CountSettings, LimitSettings, RemoteSettings, ResultSettings, Settings,
        SettingsError, explain, find_calibrations, is_installed,
    },
    telemetry::Tracer,
    tls::Tls,
    views::Views,
};

/// Longest time that the start waits for the calibrations. The rest is read while the server
/// listens, and the server is ready after that.
const CALIBRATIONS_WAIT: Duration = Duration::from_secs(3);

/// Interval of the checks that the calibrations were read.
const CALIBRATIONS_CHECK: Duration = Duration::from_millis(50);

/// An engine with its calibrations and models.
pub struct Assembly {
    /// The engine.
    pub engine: Engine,
    /// Its calibrations.
    pub calibrations: Arc<Calibrations>,
    /// Its models.
    pub models: Arc<ModelRepository>,
    /// The metrics of all of these.
    pub metrics: Arc<Metrics>,
}

/// Creates the engine that the settings describe, with no model loaded yet.
///
/// # Errors
/// One sentence that names the setting, for a file that is missing or cannot be used.
pub fn assemble(settings: &Settings) -> anyhow::Result<Assembly> {
    let (store, writable) = (calibration_store(settings)?, settings.calibrations.writable);
    let metrics = Arc::<Metrics>::default();
    let calibrations =
        Calibrations::open_within(store, writable, CALIBRATIONS_WAIT, Arc::clone(&metrics));
    let calibrations = calibrations.context("calibrations.path")?;
    assemble_with(settings, calibrations, metrics)
}

fn assemble_with(
    settings: &Settings,
    calibrations: Arc<Calibrations>,
    metrics: Arc<Metrics>,
) -> anyhow::Result<Assembly> {
    let (models, default_models) = open(settings, &metrics.detect)?;
    let options = EngineOptions {
        decode_limits: decode_limits(&settings.limits),
        default_models,
        batches: BatchOptions {
            max_views: settings.threads.batch_views,
            max_delay: settings.inference.max_queue_delay,
        },
        sessions: settings.threads.sessions,
        remap_threads: settings.threads.remapping,
        rig_cache_bytes: settings.calibrations.cache_bytes,
    };
    let known = Arc::clone(&calibrations);
    let registry = Arc::clone(&models.registry);
    let engine = Engine::new(registry, Some(known), options, Arc::clone(&metrics.detect))
        .context("the operating system gives no threads")?;
    Ok(Assembly {
        engine,
        calibrations,
        models: Arc::new(models),
        metrics,
    })
}

/// The decoding limits of the settings.
pub(crate) fn decode_limits(limits: &LimitSettings) -> DecodeLimits {
    DecodeLimits {
        max_width: limits.max_image_side,
        max_height: limits.max_image_side,
        max_pixels: limits.max_image_pixels,
        max_alloc_bytes: limits.max_decode_bytes,
    }
}

/// Creates the engine that the settings describe, with the models that requests with any of these
/// parameters need.
///
/// # Errors
/// One sentence that names the setting, for a file that is missing or cannot be used.
pub fn engine_for(settings: &Settings, requests: &[DetectParameters]) -> anyhow::Result<Engine> {
    let calibrations = Arc::new(open_calibrations(settings)?);
    let assembly = assemble_with(settings, calibrations, Arc::default())?;
    let Assembly { engine, models, .. } = assembly;
    for request in requests {
        for name in engine.default_models().needed_by(request) {
            if models.registry.get(name).is_none() {
                models.load(name)?;
            }
        }
    }
    Ok(engine)
}

/// A running service without its socket.
pub struct App {
    /// Names of the models to load. Readiness waits for the first.
    to_load: Vec<String>,
    /// The API keys, if there are any.
    keys: Option<Arc<AccessKeys>>,
    /// The certificate, if TLS is configured.
    tls: Option<Arc<Tls>>,
    /// The MQTT publisher, if a broker is configured.
    publisher: Option<Publisher>,
    state: ApiState,
    settings: Arc<Settings>,
}

impl App {
    /// Returns the metrics of the server.
    pub fn metrics(&self) -> &Metrics {
        &self.state.metrics
    }

    /// Starts the workers. No model is loaded yet: [`App::serve`] does that. Needs a tokio runtime.
    ///
    /// # Errors
    /// If the operating system creates no thread, or the keys, the certificate or the collector
    /// cannot be used.
    pub fn start(assembly: Assembly, settings: Settings) -> anyhow::Result<Self> {
        let Assembly {
            engine,
            calibrations,
            models,
            metrics,
        } = assembly;
        settings.access.check_exposure(settings.server.listen)?;
        let keys = open_keys(&settings.access)?;
        if settings.detect.follow() {
            tracing::info!(
                "detect.follow: persons are followed between searches of the whole frame"
            );
        }
        let to_load = models_to_load(engine.default_models(), &settings);
        let (workers, capacity) = (
            settings.threads.frame_workers,
            settings.limits.max_frames_in_flight,
        );
        let workers = WorkerPool::start(&Arc::new(engine), workers, capacity)
            .context("the operating system creates no thread for a worker")?;
        let companions = companions(&settings.counts)?;
        let own = companions.own_cameras();
        let results = open_results(&settings.results, own, Arc::clone(&metrics))?;
        let references = ReferenceCounts::open(&settings.state.path, Timestamp::now());
        let references = Arc::new(references);
        let tls = match settings.tls.clone() {
            Some(options) => Some(Arc::new(Tls::open(options, Arc::clone(&metrics))?)),
            None => None,
        };
        let access = match &keys {
            Some(keys) => Access::Keys(Arc::clone(keys)),
            None => Access::Open {
                own_machine_only: !settings.access.open,
            },
        };
        let tracer = Tracer::start(&settings.traces)?;
        let views = Views::new(
            settings.state.path.clone(),
            decode_limits(&settings.limits),
            settings.results.conceal_images,
        );
        views.load()?;
        let views = Arc::new(views);
        let publisher = settings.mqtt.clone().map(|mut options| {
            if options.image_every.is_some() {
                options.discovery.images = settings.results.images_of.clone();
            }
            let followed = companions.followed();
            let references = Arc::clone(&references);
            Publisher::new(
                options,
                Arc::clone(&results),
                followed,
                references,
                Arc::clone(&metrics),
                Arc::clone(&views),
            )
        });
        let settings = Arc::new(settings);
        let options = ApiOptions {
            settings: Arc::clone(&settings),
            views,
            access,
            companions,
            references,
            tracer,
        };
        let state = ApiState::new(
            Arc::new(workers),
            models,
            calibrations,
            results,
            metrics,
            Readiness::default(),
            options,
        );
        Ok(Self {
            to_load,
            keys,
            tls,
            publisher: publisher.transpose()?,
            state,
            settings,
        })
    }

    /// The cameras and counts of this process.
    pub fn companions(&self) -> Companions {
        self.state.options.companions.clone()
    }

    /// Answers requests to `/cameras` with these cameras, and publishes a switch for each to MQTT.
    pub fn set_cameras(&mut self, cameras: &Arc<Cameras>) {
        let options = &self.state.options;
        options.views.show_frames(cameras.viewers());
        options.companions.set_cameras(Arc::clone(cameras));
        if let Some(publisher) = &mut self.publisher {
            publisher.add_switches(Arc::clone(cameras));
        }
    }

    /// Returns the connection of parts of this process to the server.
    pub fn in_process(&self) -> InProcess {
        let router = api::in_process_router(self.state.clone());
        let state = self.state.clone();
        let most_pixel_bytes = move |camera: &str| {
            let settings = &state.options.settings;
            // A file is kept as it is; pixels would be encoded again.
            if settings.results.conceal_images.is_none() && state.keeps_image(camera) {
                return 0;
            }
            // A few cameras at a time fit into the half that one client has.
            let share = settings.limits.max_upload_bytes / 8;
            settings.server.max_body_bytes.min(share)
        };
        api::in_process(router, self.companions().own_cameras(), most_pixel_bytes)
    }

    /// The readiness of the app. Clones share its state.
    pub fn readiness(&self) -> Readiness {
        self.state.readiness.clone()
    }

    /// The tracer of the requests. The caller shuts it down at the end of the process.
    pub fn tracer(&self) -> Tracer {
        self.state.options.tracer.clone()
    }
}

fn models_to_load(defaults: &DefaultModels, settings: &Settings) -> Vec<String> {
    let mut names: Vec<_> = defaults.names().map(ToOwned::to_owned).collect();
    let floor = settings
        .detect
        .floor()
        .then(|| defaults.floor_model().to_owned());
    for name in settings.model.also_load.iter().chain(&floor) {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    names
}

pub(crate) fn open_calibrations(settings: &Settings) -> anyhow::Result<Calibrations> {
    let (store, writable) = (calibration_store(settings)?, settings.calibrations.writable);
    Calibrations::open(store, writable, Arc::default()).context("calibrations.path")
}

fn calibration_store(settings: &Settings) -> anyhow::Result<Box<FolderStore>> {
    let folder = &settings.calibrations.path;
    Ok(Box::new(match find_calibrations(folder)? {
        Some(folder) => FolderStore::new(&folder),
        None => FolderStore::that_may_be_missing(folder),
    }))
}

/// Opens the result store of the settings. It connects to a Redis in the background.
fn open_results(
    settings: &ResultSettings,
    own: OwnCameras,
    metrics: Arc<Metrics>,
) -> anyhow::Result<Arc<dyn ResultStore>> {
    Ok(match settings.redis.clone() {
        Some(redis) => Arc::new(RedisResults::start(redis, settings.limits, metrics)?),
        None => Arc::new(MemoryResults::new(settings.limits, metrics).with_own(own)),
    })
}

/// Opens the API keys of the settings. `None` if the settings name neither keys nor a file. With a
/// file, keys are required even while it holds none.
fn open_keys(settings: &AccessSettings) -> anyhow::Result<Option<Arc<AccessKeys>>> {
    if !settings.needs_keys() {
        return Ok(None);
    }
    let keys = AccessKeys::open(settings.keys.clone(), settings.keys_file.as_deref())?;
    Ok(Some(Arc::new(keys)))
}

/// The counts of another host, if the settings name one. Needs a tokio runtime.
fn companions(settings: &CountSettings) -> anyhow::Result<Companions> {
    let companions = Companions::default();
    if let Some(url) = &settings.url {
        let key = settings.api_key_file.as_deref();
        let key = key.map(lookdown_count::read_key).transpose()?;
        let options = ServerOptions {
            url: url.clone(),
            api_key: key,
            authorities: None,
            in_process: None,
        };
        let client = ServerClient::new(&options)?;
        let (sender, numbers) = watch::channel(PersonsByCamera::new());
        tokio::spawn(read_persons(client.clone(), sender));
        let followed = companions.followed();
        followed.set(move |camera| numbers.borrow().get(camera).copied());
        companions.forward_counts(client, lookdown_count::openapi_document);
    }
    Ok(companions)
}

/// Opens the repository without loading a model. Also returns the default models.
///
/// # Errors
/// One sentence that names the setting, for a file that is missing or cannot be used.
fn open(
    settings: &Settings,
    metrics: &Arc<DetectMetrics>,
) -> anyhow::Result<(ModelRepository, DefaultModels)> {
    let path = settings.model.find_repository()?;
    let mut one = settings.model.find_one()?;
    let remote = settings.remote.as_ref();
    if let (None, Some(model)) = (&one, remote.and_then(|remote| remote.model.as_ref())) {
        one = Some(path.join(model));
    }
    let elsewhere = match one {
        Some(path) => {
            let manifest =
                ModelManifest::locate(&path).map_err(|error| anyhow!(explain(&error)))?;
            Some((manifest.name, path))
        }
        None => None,
    };
    let defaults = match &elsewhere {
        Some((name, _)) => DefaultModels::one(name.clone()),
        None => DefaultModels::for_device(settings.inference.device),
    };
    let called = defaults.model().to_owned();
    let options = RepositoryOptions {
        folder: ModelFolder { path, elsewhere },
        warm_up_views: settings.threads.batch_views,
        explain,
    };
    let repository = match remote {
        Some(remote) => {
            let remote = remote_options(remote, called);
            let server = RemoteServer::new(remote, Arc::clone(metrics));
            let server = Arc::new(server.map_err(|error| anyhow!(explain(&error)))?);
            let loader = remote_loader(settings, Arc::clone(&server));
            ModelRepository::new(options, loader, Arc::clone(metrics)).on(server)
        }
        None => ModelRepository::new(options, local_loader(settings)?, Arc::clone(metrics)),
    };
    Ok((repository, defaults))
}

/// Returns the loader of models that run in this process.
fn local_loader(settings: &Settings) -> Result<ModelLoader, SettingsError> {
    let library = settings.inference.find_library()?;
    let options = onnx_options(settings);
    let load = onnx_loader(library, options, settings.threads.sessions);
    Ok(Box::new(move |path| {
        warn_of_missing_sum(path);
        load(path)
    }))
}

/// Logs a warning if a model outside the installation has no sum: anyone who can write there can
/// replace it.
fn warn_of_missing_sum(model: &Path) {
    // The loader reports a manifest that cannot be read.
    let has_sum = |manifest: ModelManifest| manifest.sha256.is_some();
    if !is_installed(model) && ModelManifest::locate(model).is_ok_and(|manifest| !has_sum(manifest))
    {
        tracing::warn!(
            model = %model.display(),
            "this model is not part of the installation and its manifest has no sha256, so changes of \
             its file are not noticed: enter the sum that `lookdown model check` prints"
        );
    }
}

/// Returns the loader of models that run on an inference server.
fn remote_loader(settings: &Settings, server: Arc<RemoteServer>) -> ModelLoader {
    let options = candidate_options(settings);
    let sessions = settings.threads.sessions;
    Box::new(move |path| {
        let (first, others) = RemoteDetector::load_sessions(&server, path, options, sessions)?;
        Ok(Model::from_sessions(first, others))
    })
}

/// The inference server of the settings. `called` is the model's name in this process.
fn remote_options(remote: &RemoteSettings, called: String) -> RemoteOptions {
    RemoteOptions {
        url: remote.url.clone(),
        token: remote.token.clone(),
        model: remote.model.clone().unwrap_or_else(|| called.clone()),
        called,
        timeout: remote.timeout,
    }
}

/// The settings of the ONNX runtime.
pub(crate) fn onnx_options(settings: &Settings) -> OnnxOptions {
    let device = settings.inference.device;
    OnnxOptions {
        device,
        threads: settings.threads.per_session,
        views_per_run: (!device.is_processor()).then_some(settings.threads.batch_views),
        candidates: candidate_options(settings),
    }
}

fn candidate_options(settings: &Settings) -> CandidateOptions {
    CandidateOptions {
        score_floor: settings.inference.score_floor,
        max_detections_per_view: settings.inference.max_detections_per_view.get(),
    }
}

//! Where everything is put together: settings → engine → workers → service.

use std::{net::SocketAddr, num::NonZeroUsize, sync::Arc};

use anyhow::Context;
use axum::serve::ListenerExt;
use tokio::{net::TcpListener, task::spawn_blocking, time::sleep};

use crate::{
    api::{self, ApiOptions, ApiState, Phase, Readiness},
    calibration::CalibrationFolder,
    imaging::decode::DecodeLimits,
    inference::{OnnxDetector, OnnxOptions},
    metrics::Metrics,
    pipeline::{Engine, EngineOptions, ModelUsed, WorkerPool},
    settings::Settings,
    shutdown::Shutdown,
};

/// The next frame is decoded while the network works on the current one.
const WORKERS: NonZeroUsize = NonZeroUsize::new(2).unwrap();

/// The engine that the settings describe: loads ONNX Runtime and the model.
///
/// # Errors
/// One sentence that names the setting: a file that is missing or cannot be used.
pub fn build_engine(settings: &Settings) -> anyhow::Result<Engine> {
    let inference = &settings.inference;
    let library = inference.find_library()?;
    let model = settings.model.find()?;
    let options = OnnxOptions {
        threads: inference.threads,
        score_floor: inference.score_floor,
        max_detections_per_view: inference.max_detections_per_view.get(),
    };
    let detector = OnnxDetector::load(&library, &model, options)?;
    let limits = &settings.limits;
    let options = EngineOptions {
        decode_limits: DecodeLimits {
            max_width: limits.max_image_side,
            max_height: limits.max_image_side,
            max_pixels: limits.max_image_pixels,
            max_alloc_bytes: limits.max_decode_bytes,
        },
        max_batch_views: inference.max_batch_views,
        paper_field_of_view: settings.paper.field_of_view,
        rig_cache_bytes: settings.calibrations.cache_bytes,
    };
    Ok(Engine::new(
        Box::new(detector),
        open_calibrations(settings)?,
        options,
    ))
}

/// A running service without its socket.
pub struct App {
    engine: Arc<Engine>,
    workers: Arc<WorkerPool>,
    readiness: Readiness,
    state: ApiState,
    settings: Settings,
}

impl App {
    /// Starts the workers. The network is still cold: [`App::serve`] warms it up.
    ///
    /// # Errors
    /// When the operating system gives no thread.
    pub fn start(engine: Engine, settings: Settings) -> anyhow::Result<Self> {
        let engine = Arc::new(engine);
        let capacity = settings.limits.max_frames_in_flight;
        let workers = WorkerPool::start(&engine, WORKERS, capacity)
            .context("the operating system gives no thread for a worker")?;
        let workers = Arc::new(workers);
        let metrics = Metrics::new()?;
        metrics
            .build_info
            .with_label_values(&[env!("CARGO_PKG_VERSION")])
            .set(1);
        let readiness = Readiness::default();
        let options = ApiOptions {
            max_body_bytes: settings.server.max_body_bytes,
            max_upload_bytes: settings.limits.max_upload_bytes,
            request_timeout: settings.server.request_timeout,
        };
        let state = ApiState::new(
            Arc::clone(&workers),
            Arc::new(metrics),
            readiness.clone(),
            options,
        );
        Ok(Self {
            engine,
            workers,
            readiness,
            state,
            settings,
        })
    }

    /// Whether frames are welcome: clones follow the app.
    #[must_use]
    pub fn readiness(&self) -> Readiness {
        self.readiness.clone()
    }

    /// Serves until `shutdown` asks for an end. Then readiness goes, no more connections are
    /// accepted, and what has arrived is answered, for as long as one request may take; a second
    /// request to stop ends that, too.
    ///
    /// # Errors
    /// When the network cannot run or the socket fails.
    pub async fn serve(self, listener: TcpListener, shutdown: Shutdown) -> anyhow::Result<()> {
        let address = listener.local_addr()?;
        log_start(&self.settings, self.engine.model(), address);
        let stop = shutdown.clone();
        let readiness = self.readiness.clone();
        let stopping = async move {
            stop.requested().await;
            readiness.stopping();
            tracing::info!("told to stop: finishing what has arrived");
        };
        let listener = listener.tap_io(|connection| {
            // Without it answers wait for the client's acknowledgement of earlier ones.
            let _ = connection.set_nodelay(true);
        });
        let connections = axum::serve(listener, api::router(self.state.clone()));
        let connections = connections.with_graceful_shutdown(stopping);
        // Both must end: the process must not exit while the network still warms up.
        let finished = async {
            tokio::try_join!(self.warm_up(address), async { Ok(connections.await?) })?;
            anyhow::Ok(())
        };
        let patience = self.settings.server.request_timeout;
        let out_of_patience = async {
            shutdown.requested().await;
            sleep(patience).await;
        };
        tokio::select! {
            biased;
            () = shutdown.requested_at_once() => {
                tracing::warn!("stopped at once");
                return Ok(());
            }
            outcome = finished => outcome?,
            () = out_of_patience => {
                tracing::warn!("stopped, although some requests had not ended");
                return Ok(());
            }
        }
        let workers = self.workers;
        spawn_blocking(move || workers.shut_down()).await?;
        tracing::info!("stopped");
        Ok(())
    }

    /// Runs the network once.
    async fn warm_up(&self, address: SocketAddr) -> anyhow::Result<()> {
        let engine = Arc::clone(&self.engine);
        spawn_blocking(move || engine.warm_up()).await??;
        self.readiness.warmed_up();
        if self.readiness.phase() == Phase::Ready {
            let port = address.port();
            tracing::info!("ready: try curl -F img=@samples/office.jpg localhost:{port}/detect");
        }
        Ok(())
    }
}

fn open_calibrations(settings: &Settings) -> anyhow::Result<Option<CalibrationFolder>> {
    let folder = settings.calibrations.find()?;
    let opened = folder.map(|folder| CalibrationFolder::open(&folder));
    Ok(opened.transpose()?)
}

/// Says what runs, and where.
fn log_start(settings: &Settings, model: &ModelUsed, address: SocketAddr) {
    tracing::info!(
        version = env!("CARGO_PKG_VERSION"),
        model = model.name,
        revision = model.revision,
        threads = settings.inference.threads,
        calibrations = %settings.calibrations.path.display(),
        "listening on http://{address}, API page at http://{address}/docs"
    );
}

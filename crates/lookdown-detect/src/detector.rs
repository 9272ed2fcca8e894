//! Detection in this process: the engine with models that are loaded when they are needed.

use std::{num::NonZeroUsize, path::PathBuf, sync::Arc, thread::available_parallelism};

use lookdown_calibration::Calibration;
use parking_lot::Mutex;

use crate::{
    inference::{
        CandidateOptions, Device, ModelFolder, ModelRepository, OnnxOptions, RepositoryError,
        RepositoryOptions, onnx_loader,
    },
    metrics::DetectMetrics,
    parameters::DetectParameters,
    pipeline::{
        DefaultModels, DetectJob, DetectionReport, Engine, EngineOptions, JobImage, PipelineError,
    },
};
use lookdown_imaging::Frame;

/// The library of ONNX Runtime that `make setup` fetches.
pub const DEFAULT_ONNX_RUNTIME: &str = "runtime/libonnxruntime.so";
/// The folder of the models in the repository.
pub const DEFAULT_MODELS: &str = "models";

/// The options of a [`Detector`].
#[derive(Debug, Clone, PartialEq)]
pub struct DetectorOptions {
    /// The library of ONNX Runtime, `libonnxruntime.so` 1.24 or newer.
    pub onnx_runtime: PathBuf,
    /// The folder of the models, each a folder with a `model.toml`.
    pub models: PathBuf,
    /// The device that runs the networks.
    pub device: Device,
    /// Threads that run networks, each with a session of its own, and as many that render views.
    pub threads: NonZeroUsize,
}

impl Default for DetectorOptions {
    /// Returns [`DEFAULT_ONNX_RUNTIME`] and [`DEFAULT_MODELS`] on the CPU, with a thread for each
    /// core.
    fn default() -> Self {
        Self {
            onnx_runtime: DEFAULT_ONNX_RUNTIME.into(),
            models: DEFAULT_MODELS.into(),
            device: Device::Cpu,
            threads: available_parallelism().unwrap_or(NonZeroUsize::MIN),
        }
    }
}

/// A [`Detector`] that cannot start, or a frame in which it cannot detect persons.
#[derive(Debug, thiserror::Error)]
pub enum DetectorError {
    /// The operating system cannot start threads.
    #[error("the operating system cannot start threads: {0}")]
    Threads(#[from] std::io::Error),
    /// A model cannot be loaded.
    #[error(transparent)]
    Model(#[from] RepositoryError),
    /// The frame cannot be processed.
    #[error(transparent)]
    Frame(#[from] PipelineError),
}

/// Detects persons in frames. Several threads may share it.
pub struct Detector {
    engine: Engine,
    models: ModelRepository,
    /// Held while models are loaded: the repository refuses to load two at once.
    loading: Mutex<()>,
}

impl Detector {
    /// Starts the threads. A model is loaded by the first frame that needs it.
    ///
    /// # Errors
    /// [`DetectorError::Threads`].
    pub fn new(options: &DetectorOptions) -> Result<Self, DetectorError> {
        let default_models = DefaultModels::for_device(options.device);
        let metrics = Arc::<DetectMetrics>::default();
        let onnx = OnnxOptions {
            device: options.device,
            threads: NonZeroUsize::MIN,
            views_per_run: None,
            candidates: CandidateOptions::DEFAULT,
        };
        let engine_options = EngineOptions::new(default_models, options.threads);
        let models = ModelRepository::new(
            RepositoryOptions {
                folder: ModelFolder {
                    path: options.models.clone(),
                    elsewhere: None,
                },
                warm_up_views: NonZeroUsize::MIN,
                explain: ToString::to_string,
            },
            onnx_loader(options.onnx_runtime.clone(), onnx, engine_options.sessions),
            Arc::clone(&metrics),
        );
        let registry = Arc::clone(&models.registry);
        let engine = Engine::new(registry, None, engine_options, metrics)?;
        Ok(Self {
            engine,
            models,
            loading: Mutex::default(),
        })
    }

    /// Detects the persons in a frame of `camera`. Without a camera, an equidistant lens of 180° on
    /// the lens circle of the frame is assumed. Blocks.
    ///
    /// # Errors
    /// [`DetectorError::Model`] if a model of the profile cannot be loaded,
    /// [`DetectorError::Frame`] if the frame does not fit the camera.
    pub fn detect(
        &self,
        frame: Arc<Frame>,
        camera: Option<Arc<Calibration>>,
        parameters: &DetectParameters,
    ) -> Result<DetectionReport, DetectorError> {
        self.load_models(parameters)?;
        let image = JobImage::Decoded(frame);
        let job = DetectJob::local(String::new(), image, parameters.clone(), camera);
        Ok(self.engine.detect(&job)?.report)
    }

    /// Loads the models of the parameters that are not loaded yet.
    fn load_models(&self, parameters: &DetectParameters) -> Result<(), RepositoryError> {
        let _only_loader = self.loading.lock();
        for name in self.engine.default_models().needed_by(parameters) {
            if self.models.registry.get(name).is_none() {
                self.models.load(name)?;
            }
        }
        Ok(())
    }
}

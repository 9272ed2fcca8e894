//! Detectors run by ONNX Runtime. Only this module and `description` use `ort`.

use std::{
    num::NonZeroUsize,
    path::{Path, PathBuf},
    sync::OnceLock,
};

use lookdown_calibration::revision::{revision_of, sha256_of};
use lookdown_imaging::{NetworkInput, ViewBatch};
use ort::{
    environment::Environment,
    ep::{
        CUDA, ExecutionProvider, ExecutionProviderDispatch, OpenVINO, TensorRT,
        cuda::ConvAlgorithmSearch,
    },
    session::Session,
    value::TensorRef,
};
use parking_lot::Mutex;

use super::{
    CandidateOptions, Device, Model, ModelLoader,
    description::{self, ModelDescription, OnnxTensor},
    detector::{Detector, HeadOutput},
    error::InferenceError,
    heads::{Head, TensorView},
    manifest::ModelManifest,
    onnx_file,
    staging::{Staged, Staging},
};

/// A model in an ONNX file, with the output head of its manifest.
pub struct OnnxDetector {
    session: Session,
    /// Description of the model, from its manifest and its ONNX file.
    pub description: ModelDescription,
    staging: Staging,
    options: OnnxOptions,
}

impl OnnxDetector {
    /// Loads ONNX Runtime from `library` (once per process) and the model at `model`: a folder
    /// with a `model.toml`, or an ONNX file.
    ///
    /// # Errors
    /// [`InferenceError`] when the library, the device or the model cannot be used.
    pub fn load(
        library: &Path,
        model: &Path,
        options: &OnnxOptions,
    ) -> Result<Self, InferenceError> {
        Ok(Self::load_sessions(library, model, options, NonZeroUsize::MIN)?.0)
    }

    /// Like [`OnnxDetector::load`], in `count` sessions that run in parallel. Returns the first
    /// session and the others. The file is read and checked once, and the other sessions are built
    /// concurrently.
    ///
    /// # Errors
    /// [`InferenceError`] when the library, the device or the model cannot be used.
    pub fn load_sessions(
        library: &Path,
        model: &Path,
        options: &OnnxOptions,
        count: NonZeroUsize,
    ) -> Result<(Self, Vec<Self>), InferenceError> {
        let environment = load_environment(library)?;
        let manifest = ModelManifest::locate(model)?;
        let path = manifest.onnx.clone();
        let unusable = unusable(&path);
        let bytes = onnx_file::read(&path)?;
        let sha256 = sha256_of(&bytes);
        check_sum(&manifest, &sha256).map_err(unusable)?;
        onnx_file::check(&bytes).map_err(unusable)?;

        let open = || open(environment, library, options, &path, &bytes);
        // Reports a failing model once, before every thread logs the same failure.
        let session = open()?;
        let others = std::thread::scope(|scope| {
            let opening: Vec<_> = (1..count.get()).map(|_| scope.spawn(open)).collect();
            let opened = opening.into_iter().map(|thread| {
                let panicked = |_| Err(unusable("the runtime panics on it".to_owned()));
                thread.join().unwrap_or_else(panicked)
            });
            opened.collect::<Result<Vec<_>, _>>()
        })?;
        let metadata = description::metadata(&session);
        let (inputs, outputs) = description::tensors(&session);
        let fitted = manifest.fit(&inputs, &outputs, &metadata);
        let (signature, input) = fitted.map_err(unusable)?;
        // The revision covers the settings of the manifest in addition to the weights.
        let used = format!("{sha256} {:?} {:?}", manifest.input, manifest.output);
        let description = ModelDescription {
            revision: revision_of(used.as_bytes()),
            bytes: bytes.len(),
            sha256,
            input,
            inputs,
            outputs,
            layout: signature.layout,
            views_per_run: signature.views_per_run,
            license: manifest.license.clone().or(metadata.license),
            manifest,
        };
        let detector = |session| Self {
            session,
            description: description.clone(),
            staging: Staging::new(&signature, options.views_per_run),
            options: options.clone(),
        };
        let others = others.into_iter().map(detector).collect();
        Ok((detector(session), others))
    }

    /// Returns the inputs and outputs of an ONNX file, which needs no manifest.
    ///
    /// # Errors
    /// [`InferenceError`] when the library, the device or the file cannot be used.
    pub fn tensors(
        library: &Path,
        file: &Path,
        options: &OnnxOptions,
    ) -> Result<(Vec<OnnxTensor>, Vec<OnnxTensor>), InferenceError> {
        let environment = load_environment(library)?;
        let bytes = onnx_file::read(file)?;
        onnx_file::check(&bytes).map_err(unusable(file))?;
        let session = open(environment, library, options, file, &bytes)?;
        Ok(description::tensors(&session))
    }
}

/// Returns the error about a model in the file `path`.
fn unusable(path: &Path) -> impl Fn(String) -> InferenceError + Copy {
    |problem| InferenceError::Unusable {
        path: path.to_owned(),
        problem,
    }
}

/// The runtime's error message without its call stack.
fn first_line(error: &ort::Error) -> String {
    let text = error.to_string();
    let line = text.lines().next().unwrap_or_default().trim();
    line.trim_end_matches('.').to_owned()
}

fn check_sum(manifest: &ModelManifest, found: &str) -> Result<(), String> {
    match &manifest.sha256 {
        Some(wanted) if !wanted.eq_ignore_ascii_case(found) => Err(format!(
            "its SHA-256 is {found}, but the manifest says {wanted}: fetch it again, or correct \
             the manifest"
        )),
        _ => Ok(()),
    }
}

impl Detector for OnnxDetector {
    fn name(&self) -> &str {
        &self.description.manifest.name
    }

    fn revision(&self) -> &str {
        &self.description.revision
    }

    fn input(&self) -> &NetworkInput {
        &self.description.input
    }

    fn views_per_run(&self) -> Option<NonZeroUsize> {
        self.description.views_per_run
    }

    fn tells_postures(&self) -> bool {
        self.description.manifest.output.tells_postures()
    }

    fn detect(&mut self, batch: &ViewBatch) -> Result<HeadOutput, InferenceError> {
        let Self {
            session,
            description,
            staging,
            options,
        } = self;
        let input = &description.input;
        let head = &description.manifest.output;
        let max_per_view = options.candidates.max_detections_per_view;
        staging.run_pieces(batch, input, max_per_view, |staged| {
            run(session, head, staged, input, options)
        })
    }
}

/// One run of the network.
fn run(
    session: &mut Session,
    head: &Head,
    staged: &Staged<'_>,
    input: &NetworkInput,
    options: &OnnxOptions,
) -> Result<HeadOutput, InferenceError> {
    let failed = |error: ort::Error| InferenceError::Run(first_line(&error));
    let views = staged.shape[0];
    let tensor = TensorRef::from_array_view((staged.shape, staged.values)).map_err(failed)?;
    let outputs = session
        .run(ort::inputs![staged.name => tensor])
        .map_err(failed)?;
    let outputs: Vec<_> = outputs.iter().collect();
    let mut shaped = Vec::new();
    for (name, value) in &outputs {
        // Heads read only floats, but a model may have further outputs.
        if let Ok((shape, values)) = value.try_extract_tensor::<f32>() {
            let side = |&side: &i64| usize::try_from(side).unwrap_or(0);
            shaped.push((name, shape.iter().map(side).collect::<Vec<_>>(), values));
        }
    }
    let tensors: Vec<_> = shaped
        .iter()
        .map(|(name, shape, values)| TensorView {
            name,
            shape,
            values,
        })
        .collect();
    head.decode(&tensors, views, input, options.candidates.score_floor)
}

static ENVIRONMENT: OnceLock<Environment> = OnceLock::new();
/// The runtime refuses a second environment, so only one thread may create it.
static LOADING: Mutex<()> = Mutex::new(());

/// Loads the library on the first call. Later calls return the same environment.
fn load_environment(library: &Path) -> Result<&'static Environment, InferenceError> {
    let _only_loader = LOADING.lock();
    if let Some(environment) = ENVIRONMENT.get() {
        return Ok(environment);
    }
    let unusable = |detail: String| InferenceError::Runtime {
        path: library.to_owned(),
        detail,
    };
    // A bare path would first be searched beside the executable.
    let library = library
        .canonicalize()
        .map_err(|error| unusable(error.to_string()))?;
    let environment = ort::environment::init_from(&library)
        .map_err(|error| unusable(error.to_string()))?
        .with_name("lookdown")
        // The builds on PyPI record telemetry by default; SECURITY.md.
        .with_telemetry(false)
        .build()
        .map_err(|error| unusable(error.to_string()))?;
    Ok(ENVIRONMENT.get_or_init(|| environment))
}

/// Returns the loader of models that run in `sessions` sessions of the ONNX Runtime in `library`.
pub fn onnx_loader(library: PathBuf, options: OnnxOptions, sessions: NonZeroUsize) -> ModelLoader {
    Box::new(move |path| {
        let (first, others) = OnnxDetector::load_sessions(&library, path, &options, sessions)?;
        Ok(Model::from_sessions(first, others))
    })
}

/// Options for running a model.
#[derive(Debug, Clone, PartialEq)]
pub struct OnnxOptions {
    /// Device of the network.
    pub device: Device,
    /// Threads within one run of the network.
    pub threads: NonZeroUsize,
    /// Views of every run of a network that takes any number; black views take the place of missing
    /// ones. A GPU needs it: it prepares a network for each new number, which takes longer than a
    /// run. `None`: as many as there are.
    pub views_per_run: Option<NonZeroUsize>,
    /// Limits on the candidates that are kept.
    pub candidates: CandidateOptions,
}

/// Opens a session of the model `bytes`, the content of the file `path`, on the options' device,
/// without a fallback to another device.
fn open(
    environment: &Environment,
    library: &Path,
    options: &OnnxOptions,
    path: &Path,
    bytes: &[u8],
) -> Result<Session, InferenceError> {
    let device = options.device;
    let (providers, available) = providers(device, options.threads);
    if !available {
        return Err(InferenceError::NoProvider {
            device,
            path: library.to_owned(),
        });
    }
    let failed = |error: ort::Error| InferenceError::Run(first_line(&error));
    let mut builder = Session::builder(environment)
        .map_err(failed)?
        .with_intra_threads(options.threads.get())
        .map_err(|error| failed(error.into()))?
        // Idle pool threads must not spin: spinning takes CPU time from decoding and remapping.
        .with_intra_op_spinning(false)
        .map_err(|error| failed(error.into()))?
        .with_execution_providers(providers)
        .map_err(|error| InferenceError::NoDevice {
            device,
            detail: first_line(&error.into()),
        })?;
    let session = builder.commit_from_memory(bytes);
    session.map_err(|error| unusable(path)(first_line(&error)))
}

/// The device's execution providers in order of preference, and true if the library has them. The
/// CPU is always the last choice, for operators without GPU code.
fn providers(device: Device, threads: NonZeroUsize) -> (Vec<ExecutionProviderDispatch>, bool) {
    let cuda = |number| {
        CUDA::default()
            .with_device_id(number)
            // The default measures all algorithms for each new size of a batch, about a second each
            // time, and the number of crops changes from frame to frame.
            .with_conv_algorithm_search(ConvAlgorithmSearch::Heuristic)
            .build()
            .error_on_failure()
    };
    match device {
        Device::Cpu => (Vec::new(), true),
        Device::Cuda(number) => (vec![cuda(number)], has::<CUDA>()),
        Device::TensorRt(number) => {
            let tensor_rt = TensorRT::default().with_device_id(number).build();
            let providers = vec![tensor_rt.error_on_failure(), cuda(number)];
            (providers, has::<TensorRT>() && has::<CUDA>())
        }
        Device::OpenVino(kind) => {
            let open_vino = OpenVINO::default()
                .with_device_type(<&str>::from(kind).to_uppercase())
                .with_num_threads(threads.get())
                .with_num_streams(1)
                .build();
            (vec![open_vino.error_on_failure()], has::<OpenVINO>())
        }
    }
}

/// Returns true if the library was built with this provider.
fn has<P: ExecutionProvider>() -> bool {
    P::is_available().unwrap_or(false)
}

//! Detectors run by ONNX Runtime. Only this module and `description` use `ort`.

mod environment;
mod first_line;
mod loader;
mod options;
mod provider;

use std::{num::NonZeroUsize, path::Path};

use lookdown_calibration::revision::{revision_of, sha256_of};
use ort::{session::Session, value::TensorRef};

use super::{
    description::{self, ModelDescription, OnnxTensor},
    detector::Detector,
    error::InferenceError,
    head_output::HeadOutput,
    heads::{Head, TensorView},
    manifest::ModelManifest,
    onnx_file,
    signature::Signature,
    staging::{Staged, Staging},
};
use lookdown_imaging::{NetworkInput, ViewBatch};

use first_line::first_line;
pub use loader::onnx_loader;
pub use options::OnnxOptions;

/// A model in an ONNX file, with the output head of its manifest.
pub struct OnnxDetector {
    session: Session,
    description: ModelDescription,
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
        let environment = environment::load(library)?;
        let manifest = ModelManifest::locate(model)?;
        let path = manifest.onnx.clone();
        let unusable = |problem: String| InferenceError::Unusable {
            path: path.clone(),
            problem,
        };
        let bytes = onnx_file::read(&path).map_err(|detail| InferenceError::Unreadable {
            path: path.clone(),
            detail,
        })?;
        let sha256 = sha256_of(&bytes);
        check_sum(&manifest, &sha256).map_err(unusable)?;
        onnx_file::check(&bytes).map_err(unusable)?;

        let open = || {
            let session = provider::builder(environment, library, options)?.commit(&bytes);
            session.map_err(|error| unusable(first_line(&error)))
        };
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
        let signature = Signature::new(&inputs, &manifest.input, &metadata).map_err(unusable)?;
        let shapes: Vec<_> = description::float_shapes(&outputs).collect();
        let size = (signature.width, signature.height);
        manifest.output.check(&shapes, size).map_err(unusable)?;
        let (scale, offset) = manifest.input.normalization().map_err(unusable)?;
        let input = NetworkInput {
            width: signature.width,
            height: signature.height,
            channel_order: manifest.input.channel_order,
            scale,
            offset,
        };
        // The revision covers the settings of the manifest in addition to the weights.
        let ModelManifest {
            input: from,
            output,
            ..
        } = &manifest;
        let used = format!("{sha256} {from:?} {output:?}");
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
        let environment = environment::load(library)?;
        let path = || file.to_owned();
        let unusable = |problem| InferenceError::Unusable {
            path: path(),
            problem,
        };
        let bytes = onnx_file::read(file).map_err(|detail| InferenceError::Unreadable {
            path: path(),
            detail,
        })?;
        onnx_file::check(&bytes).map_err(unusable)?;
        let session = provider::builder(environment, library, options)?.commit(&bytes);
        let session = session.map_err(|error| unusable(first_line(&error)))?;
        Ok(description::tensors(&session))
    }

    /// Description of the model, from its manifest and its ONNX file.
    pub fn description(&self) -> &ModelDescription {
        &self.description
    }
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

//! Detectors whose network runs on another machine, on any server of the Open Inference Protocol
//! (KServe V2) over HTTP. Views are sent as tensors, as bytes behind the JSON where the server
//! supports that, otherwise within the JSON. The head in the model's manifest decodes the outputs
//! locally.

mod connection;
mod exchange;
mod server;

pub use connection::{BearerToken, InvalidToken, RemoteOptions};
pub use server::RemoteServer;

use std::{num::NonZeroUsize, path::Path, sync::Arc};

use exchange::Question;
use lookdown_calibration::revision::revision_of;
use lookdown_common::text::{Quoted, one_line};
use lookdown_imaging::{NetworkInput, ViewBatch};
use serde::Deserialize;
use server::refusal;

use super::{
    CandidateOptions, Detector, HeadOutput, InferenceError, ModelManifest, OnnxTensor,
    description::{FLOAT, Metadata, float_shapes},
    heads::TensorView,
    signature::Signature,
    staging::{Staged, Staging},
};
use crate::open_inference::{
    BINARY_EXTENSION, Datatype,
    message::MAX_ENTRIES,
    metadata::{ModelMetadata, ServerMetadata, TensorMetadata},
};

/// A model on an inference server.
pub struct RemoteDetector {
    server: Arc<RemoteServer>,
    understood: Arc<RemoteModel>,
    staging: Staging,
    options: CandidateOptions,
}

impl RemoteDetector {
    /// Fetches the metadata of the server's model and checks it against the manifest at `model` (a
    /// folder or a `model.toml`; no ONNX file is needed). Returns `count` sessions that send in
    /// parallel: the first one and the others. Blocks.
    ///
    /// # Errors
    /// [`InferenceError`] when the server cannot be reached or the model cannot be used.
    pub fn load_sessions(
        server: &Arc<RemoteServer>,
        model: &Path,
        options: CandidateOptions,
        count: NonZeroUsize,
    ) -> Result<(Self, Vec<Self>), InferenceError> {
        let manifest = ModelManifest::locate(model)?;
        let understood = Arc::new(RemoteModel::ask(server, manifest)?);
        let session = || Self {
            server: Arc::clone(server),
            understood: Arc::clone(&understood),
            staging: Staging::new(&understood.signature, None),
            options,
        };
        let others = (1..count.get()).map(|_| session()).collect();
        Ok((session(), others))
    }
}

impl Detector for RemoteDetector {
    fn name(&self) -> &str {
        &self.understood.manifest.name
    }

    fn revision(&self) -> &str {
        &self.understood.revision
    }

    fn input(&self) -> &NetworkInput {
        &self.understood.input
    }

    fn views_per_run(&self) -> Option<NonZeroUsize> {
        self.understood.signature.views_per_run
    }

    fn tells_postures(&self) -> bool {
        self.understood.manifest.output.tells_postures()
    }

    fn detect(&mut self, batch: &ViewBatch) -> Result<HeadOutput, InferenceError> {
        let Self {
            server,
            understood,
            staging,
            options,
        } = self;
        let input = &understood.input;
        staging.run_pieces(batch, input, options.max_detections_per_view, |staged| {
            run(server, understood, staged, options.score_floor)
        })
    }
}

/// Sends one inference request.
fn run(
    server: &RemoteServer,
    understood: &RemoteModel,
    staged: &Staged<'_>,
    score_floor: f64,
) -> Result<HeadOutput, InferenceError> {
    let question = Question {
        input: staged.name,
        shape: &staged.shape,
        values: staged.values,
        outputs: &understood.outputs,
        as_bytes: understood.as_bytes,
    };
    let outputs = server.infer(&understood.name_there, &question)?;
    let tensors: Vec<_> = outputs
        .iter()
        .map(|output| TensorView {
            name: &output.name,
            shape: &output.shape,
            values: &output.values,
        })
        .collect();
    let head = &understood.manifest.output;
    head.decode(&tensors, staged.shape[0], &understood.input, score_floor)
}

/// Longest name of a tensor or a datatype.
const MAX_NAME_BYTES: usize = 256;

/// Metadata of a model on a server, checked against its manifest.
struct RemoteModel {
    manifest: ModelManifest,
    /// Name of the model on the server.
    name_there: String,
    /// Identifier that changes with the server's metadata or the manifest.
    revision: String,
    signature: Signature,
    input: NetworkInput,
    /// The outputs that heads can read.
    outputs: Vec<String>,
    /// True if the server supports tensors as bytes.
    as_bytes: bool,
}

impl RemoteModel {
    /// Fetches the metadata and checks it against the manifest.
    fn ask(server: &RemoteServer, manifest: ModelManifest) -> Result<Self, InferenceError> {
        let name_there = server.name_of(&manifest.name).to_owned();
        let unusable = |problem: String| InferenceError::RemoteModel {
            model: name_there.clone(),
            problem,
        };
        let metadata: ServerMetadata = fetch(server, &["v2"])?;
        let model: ModelMetadata = fetch(server, &["v2", "models", &name_there])?;
        if model.inputs.is_empty() || model.outputs.is_empty() {
            return Err(unusable(
                "its metadata lacks inputs and outputs: declare them on the server".to_owned(),
            ));
        }
        for tensor in model.inputs.iter().chain(&model.outputs) {
            check_tensor(tensor).map_err(unusable)?;
        }
        let (inputs, outputs) = (tensors(&model.inputs), tensors(&model.outputs));
        let fitted = manifest.fit(&inputs, &outputs, &Metadata::default());
        let (signature, network_input) = fitted.map_err(unusable)?;
        let versions = &model.versions;
        let ModelManifest { input, output, .. } = &manifest;
        let used = format!("{name_there} {versions:?} {inputs:?} {outputs:?} {input:?} {output:?}");
        Ok(Self {
            revision: revision_of(used.as_bytes()),
            input: network_input,
            outputs: float_shapes(&outputs)
                .map(|output| output.name.to_owned())
                .collect(),
            as_bytes: metadata
                .extensions
                .iter()
                .any(|name| name == BINARY_EXTENSION),
            name_there,
            signature,
            manifest,
        })
    }
}

/// Fetches and parses the metadata at a path.
fn fetch<T: for<'de> Deserialize<'de>>(
    server: &RemoteServer,
    path: &[&str],
) -> Result<T, InferenceError> {
    let reply = server.get(path)?;
    match reply.status {
        200 => {}
        401 | 403 => return Err(server.denied(refusal(&reply))),
        _ => return Err(server.unavailable(refusal(&reply))),
    }
    let read = serde_json::from_slice(&reply.body);
    read.map_err(|error| {
        let error = one_line(&error);
        server.unavailable(format!("its metadata cannot be read: {error}"))
    })
}

/// Checks that messages can repeat the name and the shape of a tensor.
fn check_tensor(tensor: &TensorMetadata) -> Result<(), String> {
    let axes = tensor.shape.len();
    if axes > MAX_ENTRIES {
        let name = Quoted(&tensor.name);
        return Err(format!(
            "its tensor {name} has {axes} axes: at most {MAX_ENTRIES} are supported"
        ));
    }
    if let Some(text) = [&tensor.name, &tensor.datatype]
        .into_iter()
        .find(|it| it.len() > MAX_NAME_BYTES)
    {
        let text = Quoted(text);
        return Err(format!(
            "the name {text} in its metadata is too long: at most {MAX_NAME_BYTES} bytes are supported"
        ));
    }
    Ok(())
}

fn tensors(declared: &[TensorMetadata]) -> Vec<OnnxTensor> {
    let tensor = |declared: &TensorMetadata| OnnxTensor {
        name: declared.name.clone(),
        element: if declared.datatype == Datatype::Fp32.name() {
            FLOAT.to_owned()
        } else {
            declared.datatype.clone()
        },
        shape: declared.shape.clone(),
    };
    declared.iter().map(tensor).collect()
}

#[cfg(test)]
mod tests;

//! What was understood of a model on a server.

use serde::Deserialize;

use super::server::{RemoteServer, refusal};
use crate::{
    imaging::NetworkInput,
    inference::{
        InferenceError, ModelManifest, OnnxTensor,
        onnx::{FLOAT, Metadata, float_shapes},
        signature::Signature,
    },
    open_inference::{BINARY_EXTENSION, Datatype},
    revision::revision_of,
};

/// What was understood of a model on a server.
pub(super) struct Understood {
    pub(super) manifest: ModelManifest,
    /// What it is called there.
    pub(super) name_there: String,
    /// Changes whenever what the server tells of it or its manifest does.
    pub(super) revision: String,
    pub(super) signature: Signature,
    pub(super) input: NetworkInput,
    /// The outputs that heads can read.
    pub(super) outputs: Vec<String>,
    /// Whether the server takes tensors as bytes.
    pub(super) as_bytes: bool,
}

#[derive(Deserialize)]
struct ServerMetadata {
    #[serde(default)]
    extensions: Vec<String>,
}

#[derive(Deserialize)]
struct ModelMetadata {
    #[serde(default)]
    versions: Option<Vec<String>>,
    #[serde(default)]
    inputs: Option<Vec<TensorMetadata>>,
    #[serde(default)]
    outputs: Option<Vec<TensorMetadata>>,
}

#[derive(Deserialize)]
struct TensorMetadata {
    name: String,
    datatype: String,
    shape: Vec<i64>,
}

impl Understood {
    /// Asks the server, and holds what it says against the manifest.
    pub(super) fn ask(
        server: &RemoteServer,
        manifest: ModelManifest,
    ) -> Result<Self, InferenceError> {
        let name_there = server.name_of(&manifest.name).to_owned();
        let unusable = |problem: String| InferenceError::RemoteModel {
            model: name_there.clone(),
            problem,
        };
        let metadata: ServerMetadata = told(server, &["v2"])?;
        let model: ModelMetadata = told(server, &["v2", "models", &name_there])?;
        let (Some(inputs), Some(outputs)) = (&model.inputs, &model.outputs) else {
            return Err(unusable(
                "its metadata name no inputs and outputs: describe them on the server".to_owned(),
            ));
        };
        let (inputs, outputs) = (tensors(inputs), tensors(outputs));
        let signature = Signature::of(&inputs, &manifest.input, &Metadata::default());
        let signature = signature.map_err(unusable)?;
        let shapes: Vec<_> = float_shapes(&outputs).collect();
        let size = (signature.width, signature.height);
        manifest.output.check(&shapes, size).map_err(unusable)?;
        let (scale, offset) = manifest.input.normalisation().map_err(unusable)?;
        let versions = model.versions.as_deref().unwrap_or_default();
        let (input, output) = (&manifest.input, &manifest.output);
        let used = format!("{name_there} {versions:?} {inputs:?} {outputs:?} {input:?} {output:?}");
        Ok(Self {
            revision: revision_of(used.as_bytes()),
            input: NetworkInput {
                width: signature.width,
                height: signature.height,
                channel_order: manifest.input.channel_order,
                scale,
                offset,
            },
            outputs: shapes.iter().map(|output| output.name.to_owned()).collect(),
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

/// Reads what the server tells at a path.
fn told<T: for<'de> Deserialize<'de>>(
    server: &RemoteServer,
    path: &[&str],
) -> Result<T, InferenceError> {
    let reply = server.get(path)?;
    match reply.status {
        200 => {}
        401 | 403 => return Err(server.denied(refusal(&reply))),
        _ => return Err(server.away(refusal(&reply))),
    }
    let read = serde_json::from_slice(&reply.body);
    read.map_err(|error| server.away(format!("its metadata cannot be read: {error}")))
}

fn tensors(told: &[TensorMetadata]) -> Vec<OnnxTensor> {
    let tensor = |told: &TensorMetadata| OnnxTensor {
        name: told.name.clone(),
        element: if told.datatype == Datatype::Fp32.name() {
            FLOAT.to_owned()
        } else {
            told.datatype.clone()
        },
        shape: told.shape.clone(),
    };
    told.iter().map(tensor).collect()
}

//! Description of a model, for its users.

use std::num::NonZeroUsize;

use ort::{
    session::Session,
    value::{Outlet, TensorElementType, ValueType},
};

use super::{
    heads::OutputShape,
    manifest::{Layout, ModelManifest},
};
use lookdown_imaging::NetworkInput;

/// Properties of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelDescription {
    /// Its manifest, `onnx` as a path that can be opened.
    pub manifest: ModelManifest,
    /// The license from the manifest, or else from the ONNX file's metadata.
    pub license: Option<String>,
    /// The ONNX file's SHA-256, hexadecimal.
    pub sha256: String,
    /// Identifier that changes with the file or the manifest's settings.
    pub revision: String,
    /// Length of the ONNX file.
    pub bytes: usize,
    /// The ONNX file's inputs.
    pub inputs: Vec<OnnxTensor>,
    /// The ONNX file's outputs.
    pub outputs: Vec<OnnxTensor>,
    /// Input format of the network.
    pub input: NetworkInput,
    /// The order of the input's axes.
    pub layout: Layout,
    /// Views per run. `None` for any number.
    pub views_per_run: Option<NonZeroUsize>,
}

/// An input or output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OnnxTensor {
    /// Its name.
    pub name: String,
    /// Element type in ONNX Runtime's notation. Only "f32" is supported.
    pub element: String,
    /// Its dimensions, -1 for those that are open. Empty for values that are not tensors.
    pub shape: Vec<i64>,
}

/// The supported element type of tensors.
pub(super) const FLOAT: &str = "f32";

/// Metadata of the ONNX file, as far as exporters write it.
#[derive(Debug, Default)]
pub(super) struct Metadata {
    pub(super) license: Option<String>,
    /// Height and width.
    pub(super) size: Option<[u32; 2]>,
    pub(super) stride: Option<u32>,
}

/// Reads the metadata keys of Ultralytics' exporter. Other exporters write none.
pub(super) fn metadata(session: &Session) -> Metadata {
    let Ok(metadata) = session.metadata() else {
        return Metadata::default();
    };
    let numbers = |key| {
        let text = metadata.custom(key).unwrap_or_default();
        let parts = text.split(|c: char| !c.is_ascii_digit());
        parts
            .filter_map(|part| part.parse().ok())
            .collect::<Vec<u32>>()
    };
    Metadata {
        license: metadata.custom("license").filter(|text| !text.is_empty()),
        size: numbers("imgsz").try_into().ok(),
        stride: numbers("stride").first().copied(),
    }
}

/// The inputs and outputs of a session.
pub(super) fn tensors(session: &Session) -> (Vec<OnnxTensor>, Vec<OnnxTensor>) {
    let all = |outlets: &[Outlet]| outlets.iter().map(tensor).collect();
    (all(session.inputs()), all(session.outputs()))
}

fn tensor(outlet: &Outlet) -> OnnxTensor {
    let (element, shape) = match outlet.dtype() {
        ValueType::Tensor {
            ty: TensorElementType::Float32,
            shape,
            ..
        } => (FLOAT.to_owned(), shape.to_vec()),
        ValueType::Tensor { ty, shape, .. } => (ty.to_string(), shape.to_vec()),
        other => (other.to_string(), Vec::new()),
    };
    OnnxTensor {
        name: outlet.name().to_owned(),
        element,
        shape,
    }
}

/// The shapes of the outputs that heads can read.
pub(super) fn float_shapes(outputs: &[OnnxTensor]) -> impl Iterator<Item = OutputShape<'_>> {
    let floats = outputs.iter().filter(|output| output.element == FLOAT);
    floats.map(|output| OutputShape {
        name: &output.name,
        shape: &output.shape,
    })
}

//! Metadata of the server and its models.

use serde::Serialize;
use utoipa::ToSchema;

use crate::open_inference::{BINARY_EXTENSION, Datatype};

/// The supported extensions of the protocol.
const EXTENSIONS: [&str; 2] = [BINARY_EXTENSION, "model_repository"];

/// The metadata of the server.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ServerMetadata {
    /// Always `lookdown`.
    name: &'static str,
    /// The version of the server.
    version: &'static str,
    /// The supported extensions of the protocol.
    extensions: [&'static str; 2],
}

impl Default for ServerMetadata {
    fn default() -> Self {
        Self {
            name: "lookdown",
            version: env!("CARGO_PKG_VERSION"),
            extensions: EXTENSIONS,
        }
    }
}

/// The liveness of the server.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ServerLive {
    /// Always true.
    pub(super) live: bool,
}

/// The readiness of the server.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ServerReady {
    /// Always true; the response is a problem otherwise.
    pub(super) ready: bool,
}

/// The readiness of a model.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ModelReady {
    /// The name.
    pub(super) name: String,
    /// Always true; the response is a problem otherwise.
    pub(super) ready: bool,
}

/// The metadata of a model.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ModelMetadata {
    /// The name.
    pub(super) name: String,
    /// The only version: for a detector its revision, as in reports.
    pub(super) versions: [String; 1],
    /// Always `lookdown`.
    pub(super) platform: &'static str,
    /// The inputs.
    pub(super) inputs: Vec<TensorMetadata>,
    /// The outputs.
    pub(super) outputs: Vec<TensorMetadata>,
}

/// The metadata of a tensor.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct TensorMetadata {
    /// The name.
    name: &'static str,
    /// The datatype.
    #[schema(value_type = String, example = "FP32")]
    datatype: Datatype,
    /// The shape; -1 for an axis of variable size.
    shape: Vec<i64>,
}

/// Returns the metadata of a tensor.
pub(super) fn tensor(
    name: &'static str,
    datatype: Datatype,
    shape: impl Into<Vec<i64>>,
) -> TensorMetadata {
    let shape = shape.into();
    TensorMetadata {
        name,
        datatype,
        shape,
    }
}

//! What the server and its models tell of themselves.

use serde::Serialize;
use utoipa::ToSchema;

use crate::open_inference::{BINARY_EXTENSION, Datatype};

/// The extensions of the protocol that are offered.
const EXTENSIONS: [&str; 2] = [BINARY_EXTENSION, "model_repository"];

/// A server.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ServerMetadata {
    /// `lookdown`.
    name: &'static str,
    /// The server's version.
    version: &'static str,
    /// The extensions of the protocol that are offered.
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

/// Whether the process answers.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ServerLive {
    /// Always true.
    pub(super) live: bool,
}

/// Whether frames can be sent.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ServerReady {
    /// Always true; otherwise the answer is a problem.
    pub(super) ready: bool,
}

/// Whether a model can be asked.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ModelReady {
    /// Its name.
    pub(super) name: String,
    /// Always true; otherwise the answer is a problem.
    pub(super) ready: bool,
}

/// A model.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ModelMetadata {
    /// Its name.
    pub(super) name: String,
    /// Its one version: of a detector the revision, as in reports.
    pub(super) versions: [String; 1],
    /// `lookdown`.
    pub(super) platform: &'static str,
    /// What it takes.
    pub(super) inputs: Vec<TensorMetadata>,
    /// What it answers.
    pub(super) outputs: Vec<TensorMetadata>,
}

/// A tensor.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct TensorMetadata {
    /// Its name.
    name: &'static str,
    /// Its datatype.
    #[schema(value_type = String, example = "FP32")]
    datatype: Datatype,
    /// Its shape, -1 where the size is not fixed.
    shape: Vec<i64>,
}

/// A tensor of a model.
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

//! The names of the server and of its only model.

use lookdown_common::text::Quoted;
use lookdown_detect::open_inference::{BINARY_EXTENSION, Datatype, metadata::TensorMetadata};

use crate::api::http::problem::{Problem, ProblemKind};

/// The name of the server, and the platform of its model.
pub(super) const NAME: &str = "lookdown";
/// The supported extensions of the protocol.
pub(super) const EXTENSIONS: [&str; 1] = [BINARY_EXTENSION];
/// The model that detects persons in frames.
pub(super) const FRAME_MODEL: &str = "lookdown";
/// The version of its inputs and outputs.
pub(super) const FRAME_MODEL_VERSION: &str = "1";

/// Refuses the name of any other model.
pub(super) fn require_frame_model(name: &str) -> Result<(), Problem> {
    if name == FRAME_MODEL {
        return Ok(());
    }
    let name = Quoted(name);
    let detail =
        format!("model: there is no model {name}: use {FRAME_MODEL}, which accepts frames");
    Err(Problem::new(ProblemKind::UnknownModel, detail))
}

/// Returns the metadata of a tensor.
pub(super) fn tensor(name: &str, datatype: Datatype, shape: impl Into<Vec<i64>>) -> TensorMetadata {
    TensorMetadata {
        name: name.to_owned(),
        datatype: datatype.to_string(),
        shape: shape.into(),
    }
}

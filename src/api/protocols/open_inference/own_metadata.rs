//! The parts of metadata that all models have in common.

use lookdown_detect::open_inference::{BINARY_EXTENSION, Datatype, metadata::TensorMetadata};

/// The name of the server, and the platform of its models.
pub(super) const NAME: &str = "lookdown";
/// The supported extensions of the protocol.
pub(super) const EXTENSIONS: [&str; 2] = [BINARY_EXTENSION, "model_repository"];

/// Returns the metadata of a tensor.
pub(super) fn tensor(name: &str, datatype: Datatype, shape: impl Into<Vec<i64>>) -> TensorMetadata {
    TensorMetadata {
        name: name.to_owned(),
        datatype: datatype.to_string(),
        shape: shape.into(),
    }
}

//! How tensors are written in the Open Inference Protocol (KServe V2) over HTTP: as lists in JSON, or as
//! bytes behind it (the extension `binary_tensor_data`). Pure; who serves it and who asks others share it.

pub mod binary_data;
mod datatype;
pub mod json_data;

pub use datatype::Datatype;

/// The header with the length of the JSON, where bytes follow it.
pub const HEAD_LENGTH: &str = "inference-header-content-length";
/// The extension of servers that take and answer tensors as bytes.
pub const BINARY_EXTENSION: &str = "binary_tensor_data";

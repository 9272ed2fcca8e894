//! The encoding of tensors in the Open Inference Protocol (KServe V2) over HTTP: as lists in JSON,
//! or as bytes after it (the extension `binary_tensor_data`). Without I/O; shared by the server and
//! the client of the protocol.

pub mod binary_data;
mod datatype;
pub mod json_data;

pub use datatype::Datatype;

/// The header with the length of the JSON, when bytes follow it.
pub const HEAD_LENGTH: &str = "inference-header-content-length";
/// The extension of servers that accept and return tensors as bytes.
pub const BINARY_EXTENSION: &str = "binary_tensor_data";

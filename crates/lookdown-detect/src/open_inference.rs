//! The Open Inference Protocol (KServe V2) over HTTP: metadata, requests and responses, with
//! tensors as lists in JSON or as bytes after it (the extension `binary_tensor_data`). Without I/O;
//! shared by the server and the client of the protocol.

pub mod message;
pub mod metadata;
mod tensor_data;

pub use self::{
    message::TensorValues,
    tensor_data::{Datatype, TensorData, element_count},
};

/// The header with the length of the JSON, when bytes follow it.
pub const HEAD_LENGTH: &str = "inference-header-content-length";
/// The extension of servers that accept and return tensors as bytes.
pub const BINARY_EXTENSION: &str = "binary_tensor_data";
/// The parameter of a tensor with the number of its bytes after the JSON.
pub const BINARY_SIZE: &str = "binary_data_size";
/// The parameter of a requested output that selects bytes.
pub const BINARY_OUTPUT: &str = "binary_data";

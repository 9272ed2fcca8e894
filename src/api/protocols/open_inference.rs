//! The Open Inference Protocol (KServe V2) over HTTP, with tensors as JSON or as bytes after it
//! (the extension `binary_tensor_data`). Source: the repository `open-inference-protocol`, and the
//! extensions as Triton Inference Server describes them.
//!
//! The only model, `lookdown`, accepts frames and returns their persons.

pub(in crate::api) mod infer;
pub(in crate::api) mod persons;
mod request;
mod tensor;

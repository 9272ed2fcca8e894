//! Errors of all detectors.

use std::{path::PathBuf, time::Duration};

use super::Device;

/// A model that cannot be loaded or run. Every message is one sentence that includes the remedy.
#[derive(Debug, thiserror::Error)]
pub enum InferenceError {
    /// The ONNX Runtime library cannot be used.
    #[error(
        "ONNX Runtime cannot be loaded from {path}: {detail}; use libonnxruntime.so 1.24 or newer"
    )]
    Runtime {
        /// Path of the library.
        path: PathBuf,
        /// Error of the loader.
        detail: String,
    },
    /// The library has no support for the device.
    #[error(
        "{device} needs a library that can use it, and {path} cannot; use the libonnxruntime.so \
         of the package {}, or use cpu",
        .device.package()
    )]
    NoProvider {
        /// The configured device.
        device: Device,
        /// The library.
        path: PathBuf,
    },
    /// The device or its driver is missing.
    #[error(
        "{device} cannot be used: {detail}; check {}, or use cpu",
        .device.requirements()
    )]
    NoDevice {
        /// The configured device.
        device: Device,
        /// Error of the runtime.
        detail: String,
    },
    /// The model file or its manifest cannot be read.
    #[error("model: {path} cannot be read: {detail}")]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// Cause of the failure.
        detail: String,
    },
    /// The model is not supported.
    #[error("model: {path} cannot be used: {problem}")]
    Unusable {
        /// Path of the file.
        path: PathBuf,
        /// The mismatch: what was found and what is needed.
        problem: String,
    },
    /// A folder has a network without a manifest.
    #[error("model: {path} does not exist; it describes {network}")]
    NoManifest {
        /// Path of the missing manifest.
        path: PathBuf,
        /// Path of the network.
        network: PathBuf,
    },
    /// The model on the inference server is not supported.
    #[error("the model {model} on the inference server cannot be used: {problem}")]
    RemoteModel {
        /// Name of the model on the server.
        model: String,
        /// The mismatch: what was found and what is needed.
        problem: String,
    },
    /// The inference server is overloaded.
    #[error("the inference server is overloaded: send fewer frames at a time, or retry")]
    RemoteBusy {
        /// Time to wait before a retry.
        retry_after: Duration,
    },
    /// The inference server cannot be reached, or its response is invalid.
    #[error("the inference server at {url} cannot be used: {detail}")]
    Remote {
        /// Address of the server.
        url: String,
        /// Cause of the failure.
        detail: String,
    },
    /// The inference server requires a token, or rejects this one.
    #[error(
        "the inference server at {url} rejects the request: {detail}; use the token that the \
         server's operator issued"
    )]
    RemoteDenied {
        /// Address of the server.
        url: String,
        /// Response of the server.
        detail: String,
    },
    /// The runtime failed on a batch.
    #[error("the network failed: {0}")]
    Run(String),
}

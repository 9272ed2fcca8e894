//! What every detector offers.

use std::{num::NonZeroUsize, path::PathBuf, time::Duration};

use super::{Device, HeadOutput};
use crate::{
    detection::{BBox, ViewPixels},
    imaging::{NetworkInput, ViewBatch},
};

/// A person found in a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewDetection {
    /// Where, corner-origin view pixels, within the view.
    pub bbox: BBox<ViewPixels>,
    /// Confidence, 0 to 1.
    pub score: f64,
}

/// A person detector. Runs on one thread at a time.
pub trait Detector: Send {
    /// The model's name.
    fn name(&self) -> &str;

    /// Changes whenever the model does.
    fn revision(&self) -> &str;

    /// What the network wants to see.
    fn input(&self) -> &NetworkInput;

    /// How many views the network takes at once, if that is fixed: fewer cost as much.
    fn views_per_run(&self) -> Option<NonZeroUsize> {
        None
    }

    /// Finds persons in a batch rendered for [`Detector::input`]: one list per view, unsorted,
    /// overlaps left in, scores at least the detector's floor.
    ///
    /// # Errors
    /// [`InferenceError`] when the run-time fails or answers in another shape than it promised.
    fn detect(&mut self, batch: &ViewBatch) -> Result<HeadOutput, InferenceError>;
}

/// A model that cannot be loaded or run. Every message is one sentence with the remedy.
#[derive(Debug, thiserror::Error)]
pub enum InferenceError {
    /// The ONNX Runtime library cannot be used.
    #[error(
        "inference.library_path: ONNX Runtime cannot be loaded from {path}: {detail}; run `make \
         setup`, or point it to libonnxruntime.so 1.24 or newer"
    )]
    Runtime {
        /// Where it was looked for.
        path: PathBuf,
        /// What the loader said.
        detail: String,
    },
    /// The library has no support for the device.
    #[error(
        "inference.device: {device} needs a library that can use it, and {path} cannot; point \
         inference.library_path to the libonnxruntime.so of the package onnxruntime-gpu, or use cpu"
    )]
    NoProvider {
        /// The device asked for.
        device: Device,
        /// The library.
        path: PathBuf,
    },
    /// The device is not there, or its driver is not.
    #[error(
        "inference.device: {device} cannot be used: {detail}; check the GPU's number and its \
         driver, CUDA and cuDNN libraries, or use cpu"
    )]
    NoDevice {
        /// The device asked for.
        device: Device,
        /// What the run-time said.
        detail: String,
    },
    /// The model file or its manifest cannot be read.
    #[error(
        "model: {path} cannot be read: {detail}; `make setup` fetches the default models and \
         `make models` the others"
    )]
    Unreadable {
        /// Which file.
        path: PathBuf,
        /// What went wrong.
        detail: String,
    },
    /// The model is not one that can be used here.
    #[error("model: {path} cannot be used: {problem}")]
    Unusable {
        /// Which file.
        path: PathBuf,
        /// What was found and what is needed.
        problem: String,
    },
    /// The model on the inference server is not one that can be used here.
    #[error("model: {model} on the server of inference.url cannot be used: {problem}")]
    RemoteModel {
        /// What it is called there.
        model: String,
        /// What was found and what is needed.
        problem: String,
    },
    /// The inference server has no place for more.
    #[error("the inference server has no place for more: send fewer frames at a time, or retry")]
    RemoteBusy {
        /// When it may have one.
        retry_after: Duration,
    },
    /// The inference server cannot be reached, or does not answer what was asked.
    #[error("inference.url: the server at {url} cannot be used: {detail}")]
    Remote {
        /// Its address.
        url: String,
        /// What went wrong.
        detail: String,
    },
    /// The inference server does not tell what it is asked without a token, or with this one.
    #[error(
        "inference.bearer_token: the server at {url} wants another: {detail}; give the one that its operator gave \
         out"
    )]
    RemoteDenied {
        /// Its address.
        url: String,
        /// What it said.
        detail: String,
    },
    /// The run-time failed on a batch.
    #[error("the network failed: {0}")]
    Run(String),
}

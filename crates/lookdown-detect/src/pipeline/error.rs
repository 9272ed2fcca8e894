//! Errors of the pipeline, with client faults and server faults as separate variants.

use std::time::Duration;

use crate::{fairness::Client, inference::InferenceError, parameters::ParameterError};
use lookdown_imaging::decode::DecodeError;

/// The reason why a frame has no report.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// A parameter of the request is invalid.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The image of the request is invalid.
    #[error(transparent)]
    Image(#[from] DecodeError),
    /// The request names a calibration that does not exist.
    #[error(
        "calibration: there is no calibration {id:?}: name one that is in the calibration folder, or leave it out"
    )]
    UnknownCalibration {
        /// The requested ID.
        id: String,
    },
    /// The request names a calibration whose file is invalid or ambiguous.
    #[error("calibration: {id:?} cannot be used: {problem}")]
    UnusableCalibration {
        /// The requested ID.
        id: String,
        /// The fault in the file, or the cameras that the request may name.
        problem: String,
    },
    /// The request names a model that is not loaded.
    #[error("model: {name:?} is not loaded; use one of {loaded}, or leave it out")]
    UnknownModel {
        /// The requested name.
        name: String,
        /// The names of the loaded models.
        loaded: String,
    },
    /// The model for people on the floor is not loaded.
    #[error(
        "floor: {name:?} is not loaded; add it to model.also_load of the server, or leave it out"
    )]
    NoFloorModel {
        /// The model's name.
        name: String,
    },
    /// The model of the request is still being loaded.
    #[error("the server is loading its models: try again in a second")]
    ModelStarting,
    /// The frame and the named calibration differ in aspect ratio.
    #[error(
        "image: the frame is {frame_width}×{frame_height} pixels, but calibration {id:?} was made \
         for {calibration_width}×{calibration_height}, which is a different aspect ratio: send an \
         uncropped frame or name another calibration"
    )]
    AspectMismatch {
        /// The calibration's ID.
        id: String,
        /// Frame width, pixels.
        frame_width: u32,
        /// Frame height, pixels.
        frame_height: u32,
        /// Image width of the calibration, pixels.
        calibration_width: u32,
        /// Image height of the calibration, pixels.
        calibration_height: u32,
    },
    /// The frame is too small to hold a lens image.
    #[error("image: the frame is {width}×{height} pixels: at least {minimum}×{minimum} are needed")]
    FrameTooSmall {
        /// Frame width, pixels.
        width: u32,
        /// Frame height, pixels.
        height: u32,
        /// The minimum side length, pixels.
        minimum: u32,
    },
    /// The queue is full.
    #[error("the queue is full ({capacity} frames): send fewer frames at a time, or retry")]
    Overloaded {
        /// The maximum number of frames that wait or are processed.
        capacity: usize,
        /// The estimated time to serve the present frames, at the recent service rate.
        retry_after: Duration,
    },
    /// The client has too many frames in the queue.
    #[error(
        "{client} uses its share of the queue already ({share} of {capacity} frames): send fewer \
         frames at a time, or retry"
    )]
    ShareUsed {
        /// The client.
        client: Client,
        /// The maximum number of frames of one client.
        share: usize,
        /// The maximum number of frames of all clients.
        capacity: usize,
        /// The estimated time to serve the present frames, at the recent service rate.
        retry_after: Duration,
    },
    /// The inference server is overloaded.
    #[error("the inference server is overloaded: send fewer frames at a time, or retry")]
    InferenceBusy {
        /// The delay after which a retry may succeed.
        retry_after: Duration,
    },
    /// The inference server is unreachable or fails.
    #[error("the inference server does not answer: try again in a few seconds")]
    InferenceUnavailable,
    /// The client cancelled the request, so its frame was not processed.
    #[error("the request was cancelled before its report was ready")]
    Withdrawn,
    /// The server is shutting down.
    #[error("the server is shutting down: send the frame to another one")]
    ShuttingDown,
    /// A fault in the server. The log contains the cause, the response does not.
    #[error("the frame could not be processed because of a fault in the server")]
    Internal(#[source] anyhow::Error),
}

/// Converts an inference error to a pipeline error.
pub(super) fn from_inference(error: &InferenceError) -> PipelineError {
    match error {
        InferenceError::RemoteBusy { retry_after } => PipelineError::InferenceBusy {
            retry_after: *retry_after,
        },
        InferenceError::Remote { .. } | InferenceError::RemoteDenied { .. } => {
            PipelineError::InferenceUnavailable
        }
        other => internal(anyhow::anyhow!("{other}")),
    }
}

/// Wraps the cause of a fault in the server.
pub(super) fn internal(cause: anyhow::Error) -> PipelineError {
    PipelineError::Internal(cause)
}

//! Why a frame got no report, by who is at fault.

use std::time::Duration;

use super::ParameterError;
use crate::{imaging::decode::DecodeError, inference::InferenceError};

/// A frame that got no report.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// The caller's parameter cannot be used.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// The caller's picture cannot be used.
    #[error(transparent)]
    Image(#[from] DecodeError),
    /// The caller named a calibration that does not exist.
    #[error(
        "calibration: there is no calibration {id:?}: name one that is in the calibration folder, or leave it out"
    )]
    UnknownCalibration {
        /// The ID asked for.
        id: String,
    },
    /// The caller named a calibration whose file gives none.
    #[error("calibration: {id:?} cannot be used: {problem}")]
    UnusableCalibration {
        /// The ID asked for.
        id: String,
        /// What is wrong with the file, or which of its cameras to name.
        problem: String,
    },
    /// The caller asked for a model that is not loaded.
    #[error("model: {name:?} is not loaded; use one of {loaded}, or leave it out")]
    UnknownModel {
        /// The name asked for.
        name: String,
        /// The models there are.
        loaded: String,
    },
    /// The model that answers is still being loaded.
    #[error("the server is loading its models: try again in a second")]
    ModelStarting,
    /// The caller's frame does not belong to the calibration it named.
    #[error(
        "image: the frame is {frame_width}×{frame_height} pixels, but calibration {id:?} was made \
         for {calibration_width}×{calibration_height}, which is another aspect: send an uncropped \
         frame or name another calibration"
    )]
    AspectMismatch {
        /// The calibration's ID.
        id: String,
        /// Frame width, pixels.
        frame_width: u32,
        /// Frame height, pixels.
        frame_height: u32,
        /// Width the calibration was made for, pixels.
        calibration_width: u32,
        /// Height the calibration was made for, pixels.
        calibration_height: u32,
    },
    /// The frame is too small to hold a lens image.
    #[error("image: the frame is {width}×{height} pixels: at least {minimum}×{minimum} are needed")]
    FrameTooSmall {
        /// Frame width, pixels.
        width: u32,
        /// Frame height, pixels.
        height: u32,
        /// The smallest side accepted, pixels.
        minimum: u32,
    },
    /// More frames are waiting than the queue holds.
    #[error("all {capacity} places in the queue are taken: send fewer frames at a time, or retry")]
    Overloaded {
        /// How many frames may wait or be worked on.
        capacity: usize,
        /// When those that are there now will have been served, if frames are served as fast as
        /// they have been.
        retry_after: Duration,
    },
    /// The server that networks run on has no place for more.
    #[error("the inference server has no place for more: send fewer frames at a time, or retry")]
    InferenceBusy {
        /// When it may have one.
        retry_after: Duration,
    },
    /// The server that networks run on cannot be reached, or fails.
    #[error("the inference server does not answer: try again in a few seconds")]
    InferenceUnavailable,
    /// Nobody waits for the report any more, so the frame was not looked at.
    #[error("the request was withdrawn before its frame had a report")]
    Withdrawn,
    /// The server is about to stop.
    #[error("the server is shutting down: send the frame to another one")]
    ShuttingDown,
    /// Our fault: logged with its cause, shown without it.
    #[error("the frame could not be processed because of a fault in the server")]
    Internal(#[source] anyhow::Error),
}

/// What a network's failure means for a frame.
pub(super) fn of_inference(error: &InferenceError) -> PipelineError {
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

/// Our own fault, with its cause.
pub(super) fn internal(cause: anyhow::Error) -> PipelineError {
    PipelineError::Internal(cause)
}

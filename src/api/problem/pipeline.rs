//! The pipeline's errors as problems: the only place that decides their status.

use super::{Problem, ProblemKind};
use crate::{
    imaging::decode::DecodeError,
    pipeline::{ParameterError, ParameterFault, PipelineError},
};

impl From<PipelineError> for Problem {
    fn from(error: PipelineError) -> Self {
        let kind = match &error {
            PipelineError::Parameter(error) => kind_of_parameter_error(error),
            PipelineError::Image(error) => kind_of_decode_error(error),
            PipelineError::UnknownCalibration { .. }
            | PipelineError::UnusableCalibration { .. } => ProblemKind::UnknownCalibration,
            PipelineError::UnknownModel { .. } => ProblemKind::UnknownModel,
            PipelineError::AspectMismatch { .. } | PipelineError::FrameTooSmall { .. } => {
                ProblemKind::UnfitImage
            }
            PipelineError::ModelStarting => ProblemKind::WarmingUp,
            PipelineError::Overloaded { .. } | PipelineError::InferenceBusy { .. } => {
                ProblemKind::Overloaded
            }
            PipelineError::InferenceUnavailable => ProblemKind::InferenceUnavailable,
            PipelineError::ShuttingDown => ProblemKind::ShuttingDown,
            PipelineError::Withdrawn => ProblemKind::Timeout,
            PipelineError::Internal(_) => ProblemKind::Internal,
        };
        match error {
            PipelineError::Internal(cause) => Self::internal(cause),
            PipelineError::Overloaded { retry_after, .. }
            | PipelineError::InferenceBusy { retry_after } => {
                Self::new(kind, error.to_string()).with_retry_after(retry_after)
            }
            told => Self::new(kind, told.to_string()),
        }
    }
}

impl From<ParameterError> for Problem {
    fn from(error: ParameterError) -> Self {
        Self::new(kind_of_parameter_error(&error), error.to_string())
    }
}

fn kind_of_parameter_error(error: &ParameterError) -> ProblemKind {
    match error.fault {
        ParameterFault::UnknownName => ProblemKind::UnknownParameter,
        ParameterFault::Repeated => ProblemKind::RepeatedParameter,
        ParameterFault::BadValue => ProblemKind::InvalidParameter,
    }
}

fn kind_of_decode_error(error: &DecodeError) -> ProblemKind {
    match error {
        DecodeError::Empty => ProblemKind::MissingImage,
        DecodeError::UnsupportedFormat { .. } => ProblemKind::UnsupportedImage,
        DecodeError::Corrupt { .. } => ProblemKind::DamagedImage,
        DecodeError::TooLarge { .. } => ProblemKind::ImageTooLarge,
    }
}

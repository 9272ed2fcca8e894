//! Converts errors of the pipeline to problems. No other place decides their kind.

use lookdown_detect::{
    parameters::{ParameterError, ParameterFault},
    pipeline::PipelineError,
};
use lookdown_imaging::decode::DecodeError;

use super::{FRAME, Problem, ProblemKind};

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
            PipelineError::Overloaded { .. }
            | PipelineError::ShareUsed { .. }
            | PipelineError::InferenceBusy { .. } => ProblemKind::Overloaded,
            PipelineError::InferenceUnavailable => ProblemKind::InferenceUnavailable,
            PipelineError::ShuttingDown => ProblemKind::ShuttingDown,
            PipelineError::Withdrawn => ProblemKind::Timeout,
            PipelineError::Internal(_) => ProblemKind::Internal,
        };
        let parameter = parameter_of(&error).map(ToOwned::to_owned);
        let problem = match error {
            PipelineError::Internal(cause) => Self::internal(cause),
            PipelineError::Overloaded { retry_after, .. }
            | PipelineError::ShareUsed { retry_after, .. }
            | PipelineError::InferenceBusy { retry_after } => {
                Self::new(kind, error.to_string()).with_retry_after(retry_after)
            }
            other => Self::new(kind, other.to_string()),
        };
        Self {
            parameter,
            ..problem
        }
    }
}

/// The parameter of the request at fault.
fn parameter_of(error: &PipelineError) -> Option<&str> {
    match error {
        PipelineError::Parameter(error) => Some(&error.name),
        PipelineError::Image(_)
        | PipelineError::AspectMismatch { .. }
        | PipelineError::FrameTooSmall { .. } => Some(FRAME),
        PipelineError::UnknownCalibration { .. } | PipelineError::UnusableCalibration { .. } => {
            Some("calibration")
        }
        PipelineError::UnknownModel { .. } => Some("model"),
        _ => None,
    }
}

impl From<ParameterError> for Problem {
    fn from(error: ParameterError) -> Self {
        let kind = kind_of_parameter_error(&error);
        Self::new(kind, error.to_string()).with_parameter(error.name)
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

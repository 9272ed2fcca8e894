//! Failures as problem documents (RFC 9457).
//!
//! A handler returns a [`Problem`]. The [envelope](super::envelope) writes it with a request ID and
//! an ID of the occurrence, logs its cause and counts it. The table of
//! [`lookdown_http::problem`] declares the kinds.

pub(in crate::api) use lookdown_http::problem::{Kind as ProblemKind, ProblemBody};

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use axum::{
    http::{
        HeaderValue, StatusCode,
        header::{RETRY_AFTER, WWW_AUTHENTICATE},
    },
    response::{IntoResponse, Response},
};
use lookdown_detect::{
    parameters::{ParameterError, ParameterFault},
    pipeline::PipelineError,
};
use lookdown_imaging::decode::DecodeError;
use serde_json::Value;
use uuid::Uuid;

use crate::calibration_store::{ChangeError, StoreError};

/// The longest `Retry-After`.
const MAX_RETRY_AFTER_SECONDS: u64 = 60;
/// The parameter of problems of the frame.
const FRAME: &str = "image";

/// The reason why a request failed.
#[derive(Debug, Clone)]
pub(in crate::api) struct Problem {
    pub(in crate::api) kind: ProblemKind,
    pub(in crate::api) status: StatusCode,
    detail: String,
    /// The parameter or form field at fault.
    parameter: Option<String>,
    /// A better `Retry-After` than that of the kind.
    retry_after: Option<Duration>,
    /// Members that a protocol adds to the document.
    members: BTreeMap<&'static str, Value>,
    /// The internal error: logged, never sent.
    pub(in crate::api) cause: Option<Arc<anyhow::Error>>,
}

impl Problem {
    /// Creates a problem with a detail of one sentence.
    pub(in crate::api) fn new(kind: ProblemKind, detail: impl Into<String>) -> Self {
        Self {
            kind,
            status: kind.entry().status,
            detail: detail.into(),
            parameter: None,
            retry_after: None,
            members: BTreeMap::new(),
            cause: None,
        }
    }

    /// Creates a problem of one parameter or form field: the detail is `parameter: fault`.
    pub(in crate::api) fn for_parameter(kind: ProblemKind, parameter: &str, fault: &str) -> Self {
        Self::new(kind, format!("{parameter}: {fault}")).with_parameter(parameter)
    }

    /// An internal error; only the log has its cause.
    pub(in crate::api) fn internal(cause: impl Into<anyhow::Error>) -> Self {
        Self {
            cause: Some(Arc::new(cause.into())),
            ..Self::fault()
        }
    }

    /// An internal error that was logged where it occurred.
    pub(in crate::api) fn fault() -> Self {
        Self::new(
            ProblemKind::Internal,
            "the server failed to process the request: its log has the reason under this request_id",
        )
    }

    /// The models are not ready yet.
    pub(in crate::api) fn warming_up() -> Self {
        Self::new(
            ProblemKind::WarmingUp,
            "the server is warming up: retry in a second",
        )
    }

    /// The server is shutting down.
    pub(in crate::api) fn shutting_down() -> Self {
        let detail = "the server is shutting down: send the request to another one";
        Self::new(ProblemKind::ShuttingDown, detail)
    }

    /// Returns the problem of a failed response: the one that the handler returned, or one for a
    /// failure of the framework.
    pub(in crate::api) fn take_from(
        response: &mut Response,
        method: &str,
        path: &str,
    ) -> Option<Self> {
        if let Some(problem) = response.extensions_mut().remove::<Self>() {
            return Some(problem);
        }
        if let Some(problem) = response
            .extensions_mut()
            .remove::<lookdown_http::problem::Problem>()
        {
            return Some(problem.into());
        }
        match response.status() {
            StatusCode::NOT_FOUND => Some(Self::new(
                ProblemKind::NotFound,
                format!("there is no resource at {path}: GET /docs lists all paths"),
            )),
            StatusCode::METHOD_NOT_ALLOWED => Some(Self::new(
                ProblemKind::MethodNotAllowed,
                format!(
                    "{path} does not support {method}: use {}",
                    remedy_for_method(method, path)
                ),
            )),
            status if status.is_client_error() => Some(Self::new(
                ProblemKind::MalformedRequest,
                "the request is malformed: compare it with GET /docs",
            )),
            status if status.is_server_error() => Some(Self::fault()),
            _ => None,
        }
    }

    /// Sets the least time before a retry.
    pub(in crate::api) fn with_retry_after(self, retry_after: Duration) -> Self {
        Self {
            retry_after: Some(retry_after),
            ..self
        }
    }

    /// Sets the parameter or form field at fault.
    pub(in crate::api) fn with_parameter(self, parameter: impl Into<String>) -> Self {
        Self {
            parameter: Some(parameter.into()),
            ..self
        }
    }

    /// Names the form field in which the client sent the frame, if the frame is at fault.
    pub(in crate::api) fn for_frame_field(self, field: Option<String>) -> Self {
        match field {
            Some(field) if self.parameter.as_deref() == Some(FRAME) => self.with_parameter(field),
            _ => self,
        }
    }

    /// Names the element of an input that has the problem.
    pub(in crate::api) fn for_element(self, input: &str, index: usize) -> Self {
        Self {
            detail: format!("{input}[{index}]: {}", self.detail),
            ..self
        }
    }

    /// Sets another status than that of the kind.
    pub(in crate::api) fn with_status(self, status: StatusCode) -> Self {
        Self { status, ..self }
    }

    /// Adds a member to the document.
    pub(in crate::api) fn with_member(
        mut self,
        name: &'static str,
        value: impl Into<Value>,
    ) -> Self {
        self.members.insert(name, value.into());
        self
    }

    /// The document that the client gets.
    pub(in crate::api) fn body(self, occurrence: &Uuid, request_id: &str) -> ProblemBody {
        ProblemBody {
            r#type: self.kind.path(),
            title: self.kind.entry().title,
            status: self.status.as_u16(),
            error: self.detail.clone(),
            detail: self.detail,
            instance: occurrence.urn().to_string(),
            request_id: request_id.to_owned(),
            parameter: self.parameter,
            members: self.members,
        }
    }
}

/// The problems of the layers that all listeners share have the kinds of the table.
impl From<lookdown_http::problem::Problem> for Problem {
    fn from(problem: lookdown_http::problem::Problem) -> Self {
        Self {
            parameter: problem.parameter,
            ..Self::new(problem.kind, problem.detail)
        }
    }
}

/// Status and headers; the envelope writes the body.
impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let mut response = self.status.into_response();
        if let Some(least) = self.kind.entry().retry_after_seconds {
            let wanted = self.retry_after.map_or(0, |after| after.as_secs() + 1);
            let seconds = HeaderValue::from(wanted.clamp(least, MAX_RETRY_AFTER_SECONDS));
            response.headers_mut().insert(RETRY_AFTER, seconds);
        }
        if self.kind == ProblemKind::KeyRequired {
            let scheme = HeaderValue::from_static("Bearer");
            response.headers_mut().insert(WWW_AUTHENTICATE, scheme);
        }
        response.extensions_mut().insert(self);
        response
    }
}
/// Names the resource that a client probably means, or the header with the methods.
fn remedy_for_method(method: &str, path: &str) -> String {
    let camera = path.strip_prefix("/results/");
    match camera.filter(|camera| method == "GET" && !camera.contains('/')) {
        Some(camera) => format!("/results/{camera}/latest"),
        None => "a method of the header Allow".to_owned(),
    }
}

/// Failed changes of calibrations as problems: the only place that decides their kind.
impl From<ChangeError> for Problem {
    fn from(error: ChangeError) -> Self {
        let parameter = parameter_of_change(&error).map(ToOwned::to_owned);
        let kind = match error {
            ChangeError::NotWritable => ProblemKind::Forbidden,
            ChangeError::Unknown { .. } => ProblemKind::UnknownCalibration,
            ChangeError::Content(_)
            | ChangeError::SeveralCameras { .. }
            | ChangeError::UnknownCamera { .. } => ProblemKind::InvalidCalibration,
            ChangeError::Outdated { .. } => ProblemKind::PreconditionFailed,
            ChangeError::Shared { .. } | ChangeError::Sample { .. } => {
                ProblemKind::CalibrationConflict
            }
            ChangeError::Unseen(_) => {
                tracing::warn!("{error}");
                let detail = "the calibration was changed, but cannot be read now: get it \
                              before you send the change again";
                return Self::new(ProblemKind::CalibrationsUnreachable, detail);
            }
            ChangeError::Store(StoreError::ReadOnly { .. }) => {
                tracing::warn!("a calibration was not changed: {error}");
                let detail = "calibrations cannot be changed: their store is read-only";
                return Self::new(ProblemKind::Forbidden, detail);
            }
            // A full disk, for example, is not a fault of the server.
            ChangeError::Store(StoreError::Failed { .. }) => {
                tracing::error!("a calibration was not changed: {error}");
                let detail =
                    "the calibrations cannot be changed now: the server's log has the reason";
                return Self::new(ProblemKind::CalibrationsUnreachable, detail);
            }
            ChangeError::Store(_) => return Self::internal(error),
        };
        Self {
            parameter,
            ..Self::new(kind, error.to_string())
        }
    }
}

/// The parameter of the request, or the field of the calibration, at fault.
fn parameter_of_change(error: &ChangeError) -> Option<&str> {
    match error {
        ChangeError::Content(error) => error.parameter(),
        ChangeError::SeveralCameras { .. } | ChangeError::UnknownCamera { .. } => Some("camera"),
        _ => None,
    }
}

/// Errors of the pipeline as problems: no other place decides their kind.
impl From<PipelineError> for Problem {
    fn from(error: PipelineError) -> Self {
        let kind = match &error {
            PipelineError::Parameter(error) => kind_of_parameter_error(error),
            PipelineError::Image(error) => kind_of_decode_error(error),
            PipelineError::UnknownCalibration { .. }
            | PipelineError::UnusableCalibration { .. } => ProblemKind::UnknownCalibration,
            PipelineError::UnknownModel { .. } | PipelineError::NoFloorModel { .. } => {
                ProblemKind::UnknownModel
            }
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
        PipelineError::NoFloorModel { .. } => Some("floor"),
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

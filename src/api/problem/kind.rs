//! Kinds of problems: a stable name, a status and a title each.

use axum::http::StatusCode;

/// A kind of problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::api) enum ProblemKind {
    /// The request does not keep to its own format.
    MalformedRequest,
    /// There is no such parameter or form field.
    UnknownParameter,
    /// A parameter or the frame was given more than once.
    RepeatedParameter,
    /// No frame was sent.
    MissingImage,
    /// No key was sent, or one that nobody has.
    KeyRequired,
    /// The sender may not do this.
    Forbidden,
    /// Nothing is at this path.
    NotFound,
    /// The calibration does not exist.
    UnknownCalibration,
    /// No report of the camera is kept.
    UnknownCamera,
    /// No picture of the camera is kept.
    PictureNotKept,
    /// The content makes no calibration.
    InvalidCalibration,
    /// The calibration's file does not allow it.
    CalibrationConflict,
    /// The place of the calibrations does not answer.
    CalibrationsUnreachable,
    /// The place of the results does not answer.
    ResultsUnreachable,
    /// What the request is about has changed.
    Outdated,
    /// The model is not loaded.
    UnknownModel,
    /// The models that are loaded do not allow it.
    ModelConflict,
    /// The model failed its check.
    ModelRefused,
    /// Another model is being loaded.
    ModelBusy,
    /// The path does not offer this method.
    MethodNotAllowed,
    /// Nothing that the client accepts is offered.
    NotAcceptable,
    /// The request has too many headers, or too long ones.
    HeadersTooLarge,
    /// The body took too long to arrive.
    SlowUpload,
    /// The body has too many bytes.
    BodyTooLarge,
    /// The frame has too many pixels.
    ImageTooLarge,
    /// The frame is in no format that can be read.
    UnsupportedImage,
    /// A parameter's value cannot be used.
    InvalidParameter,
    /// A tensor is not what the model takes.
    InvalidTensor,
    /// The frame cannot be decoded to its end.
    DamagedImage,
    /// The frame does not belong to the calibration, or is too small.
    UnfitImage,
    /// No place in the queue.
    Overloaded,
    /// No place for another connection.
    TooManyConnections,
    /// No place for another listener.
    TooManyListeners,
    /// The client sends more often than it may.
    RateLimited,
    /// A fault of ours.
    Internal,
    /// The server that networks run on does not answer.
    InferenceUnavailable,
    /// The network has not run yet.
    WarmingUp,
    /// The server was told to stop.
    ShuttingDown,
    /// The deadline has passed.
    Timeout,
}

impl ProblemKind {
    /// Every kind.
    pub(in crate::api) const ALL: [Self; 39] = [
        Self::MalformedRequest,
        Self::UnknownParameter,
        Self::RepeatedParameter,
        Self::MissingImage,
        Self::KeyRequired,
        Self::Forbidden,
        Self::NotFound,
        Self::UnknownCalibration,
        Self::UnknownCamera,
        Self::PictureNotKept,
        Self::InvalidCalibration,
        Self::CalibrationConflict,
        Self::CalibrationsUnreachable,
        Self::ResultsUnreachable,
        Self::Outdated,
        Self::UnknownModel,
        Self::ModelConflict,
        Self::ModelRefused,
        Self::ModelBusy,
        Self::MethodNotAllowed,
        Self::NotAcceptable,
        Self::HeadersTooLarge,
        Self::SlowUpload,
        Self::BodyTooLarge,
        Self::ImageTooLarge,
        Self::UnsupportedImage,
        Self::InvalidParameter,
        Self::InvalidTensor,
        Self::DamagedImage,
        Self::UnfitImage,
        Self::Overloaded,
        Self::TooManyConnections,
        Self::TooManyListeners,
        Self::RateLimited,
        Self::Internal,
        Self::InferenceUnavailable,
        Self::WarmingUp,
        Self::ShuttingDown,
        Self::Timeout,
    ];

    /// Name and title.
    fn texts(self) -> (&'static str, &'static str) {
        match self {
            Self::MalformedRequest => ("malformed-request", "The request is malformed"),
            Self::UnknownParameter => ("unknown-parameter", "There is no such parameter"),
            Self::RepeatedParameter => ("repeated-parameter", "A parameter is given twice"),
            Self::MissingImage => ("missing-image", "No frame was sent"),
            Self::KeyRequired => ("key-required", "A key that is known here is needed"),
            Self::Forbidden => ("forbidden", "That is not allowed"),
            Self::NotFound => ("not-found", "There is nothing here"),
            Self::UnknownCalibration => ("unknown-calibration", "There is no such calibration"),
            Self::UnknownCamera => ("unknown-camera", "No report of this camera is kept"),
            Self::PictureNotKept => ("picture-not-kept", "No picture of this camera is kept"),
            Self::InvalidCalibration => ("invalid-calibration", "The calibration cannot be used"),
            Self::CalibrationConflict => (
                "calibration-conflict",
                "The calibration shares its file with others",
            ),
            Self::CalibrationsUnreachable => (
                "calibrations-unreachable",
                "The place of the calibrations does not answer",
            ),
            Self::ResultsUnreachable => (
                "results-unreachable",
                "The place of the results does not answer",
            ),
            Self::Outdated => ("outdated", "What is there now is not what was meant"),
            Self::UnknownModel => ("unknown-model", "There is no such model"),
            Self::ModelConflict => (
                "model-conflict",
                "The models that are loaded do not allow that",
            ),
            Self::ModelRefused => ("model-refused", "The model cannot be used"),
            Self::ModelBusy => ("model-busy", "Another model is being loaded"),
            Self::MethodNotAllowed => ("method-not-allowed", "The method is not offered"),
            Self::NotAcceptable => ("not-acceptable", "Nothing that is accepted is offered"),
            Self::HeadersTooLarge => ("headers-too-large", "The headers are too large"),
            Self::SlowUpload => ("slow-upload", "The body took too long to arrive"),
            Self::BodyTooLarge => ("body-too-large", "The body is too large"),
            Self::ImageTooLarge => ("image-too-large", "The frame has too many pixels"),
            Self::UnsupportedImage => (
                "unsupported-image",
                "The frame is not in a format that can be read",
            ),
            Self::InvalidParameter => ("invalid-parameter", "A parameter cannot be used"),
            Self::InvalidTensor => ("invalid-tensor", "A tensor cannot be used"),
            Self::DamagedImage => ("damaged-image", "The frame is damaged or cut off"),
            Self::UnfitImage => ("unfit-image", "The frame does not fit"),
            Self::Overloaded => ("overloaded", "Too many frames are waiting"),
            Self::TooManyConnections => ("too-many-connections", "Too many connections are open"),
            Self::TooManyListeners => ("too-many-listeners", "Too many listen already"),
            Self::RateLimited => ("rate-limited", "The requests come too fast"),
            Self::Internal => ("internal", "There is a fault in the server"),
            Self::InferenceUnavailable => (
                "inference-unavailable",
                "The inference server does not answer",
            ),
            Self::WarmingUp => ("warming-up", "The server is warming up"),
            Self::ShuttingDown => ("shutting-down", "The server is shutting down"),
            Self::Timeout => ("timeout", "The deadline has passed"),
        }
    }

    /// The short name: the end of the URN, and the metrics' label.
    pub(in crate::api) fn name(self) -> &'static str {
        self.texts().0
    }

    /// Identifies the kind to programs.
    pub(in crate::api) fn urn(self) -> String {
        format!("urn:lookdown:problem:{}", self.name())
    }

    /// The HTTP status.
    pub(in crate::api) fn status(self) -> StatusCode {
        match self {
            Self::MalformedRequest
            | Self::UnknownParameter
            | Self::RepeatedParameter
            | Self::MissingImage => StatusCode::BAD_REQUEST,
            Self::KeyRequired => StatusCode::UNAUTHORIZED,
            Self::Forbidden => StatusCode::FORBIDDEN,
            Self::NotFound
            | Self::UnknownCalibration
            | Self::UnknownCamera
            | Self::PictureNotKept
            | Self::UnknownModel => StatusCode::NOT_FOUND,
            Self::ModelConflict | Self::CalibrationConflict => StatusCode::CONFLICT,
            Self::Outdated => StatusCode::PRECONDITION_FAILED,
            Self::InvalidCalibration
            | Self::ModelRefused
            | Self::InvalidParameter
            | Self::InvalidTensor
            | Self::DamagedImage
            | Self::UnfitImage => StatusCode::UNPROCESSABLE_ENTITY,
            Self::ModelBusy | Self::Overloaded | Self::TooManyListeners | Self::RateLimited => {
                StatusCode::TOO_MANY_REQUESTS
            }
            Self::MethodNotAllowed => StatusCode::METHOD_NOT_ALLOWED,
            Self::NotAcceptable => StatusCode::NOT_ACCEPTABLE,
            Self::HeadersTooLarge => StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE,
            Self::SlowUpload => StatusCode::REQUEST_TIMEOUT,
            Self::BodyTooLarge | Self::ImageTooLarge => StatusCode::PAYLOAD_TOO_LARGE,
            Self::UnsupportedImage => StatusCode::UNSUPPORTED_MEDIA_TYPE,
            Self::Internal => StatusCode::INTERNAL_SERVER_ERROR,
            Self::TooManyConnections
            | Self::CalibrationsUnreachable
            | Self::ResultsUnreachable
            | Self::InferenceUnavailable
            | Self::WarmingUp
            | Self::ShuttingDown => StatusCode::SERVICE_UNAVAILABLE,
            Self::Timeout => StatusCode::GATEWAY_TIMEOUT,
        }
    }

    /// The kind in words.
    pub(in crate::api) fn title(self) -> &'static str {
        self.texts().1
    }

    /// How long to wait at least before trying again, where that helps, seconds.
    pub(in crate::api) fn retry_after_seconds(self) -> Option<u64> {
        matches!(
            self,
            Self::Overloaded
                | Self::TooManyListeners
                | Self::RateLimited
                | Self::ModelBusy
                | Self::TooManyConnections
                | Self::CalibrationsUnreachable
                | Self::ResultsUnreachable
                | Self::InferenceUnavailable
                | Self::WarmingUp
                | Self::ShuttingDown
        )
        .then_some(1)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn the_operators_table_has_every_kind_with_its_status_and_title_and_no_other() {
        let text = include_str!("../../../docs/operations.md");
        let (_, section) = text.split_once("\n## Problems\n").unwrap();
        let (section, _) = section.split_once("\n## ").unwrap();
        let rows = section.lines().filter(|line| line.starts_with("| `"));
        let told: Vec<_> = rows
            .map(|row| {
                let cells: Vec<_> = row.trim_matches('|').split('|').map(str::trim).collect();
                assert_eq!(cells.len(), 4, "{row}");
                assert!(!cells[3].is_empty(), "{row} has no remedy");
                [cells[0].trim_matches('`'), cells[1], cells[2]].map(ToOwned::to_owned)
            })
            .collect();
        let kinds = ProblemKind::ALL.map(|kind| {
            [
                kind.name().to_owned(),
                kind.status().as_u16().to_string(),
                kind.title().to_owned(),
            ]
        });
        assert_eq!(told.len(), kinds.len());
        assert_eq!(BTreeSet::from_iter(told), BTreeSet::from(kinds));
    }
}

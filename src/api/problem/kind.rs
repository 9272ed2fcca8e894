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
    /// Nothing is at this path.
    NotFound,
    /// The calibration does not exist.
    UnknownCalibration,
    /// The model is not loaded.
    UnknownModel,
    /// The path does not offer this method.
    MethodNotAllowed,
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
    /// The frame cannot be decoded to its end.
    DamagedImage,
    /// The frame does not belong to the calibration, or is too small.
    UnfitImage,
    /// No place in the queue.
    Overloaded,
    /// A fault of ours.
    Internal,
    /// The network has not run yet.
    WarmingUp,
    /// The server was told to stop.
    ShuttingDown,
    /// The deadline has passed.
    Timeout,
}

impl ProblemKind {
    /// Every kind.
    pub(in crate::api) const ALL: [Self; 20] = [
        Self::MalformedRequest,
        Self::UnknownParameter,
        Self::RepeatedParameter,
        Self::MissingImage,
        Self::NotFound,
        Self::UnknownCalibration,
        Self::UnknownModel,
        Self::MethodNotAllowed,
        Self::SlowUpload,
        Self::BodyTooLarge,
        Self::ImageTooLarge,
        Self::UnsupportedImage,
        Self::InvalidParameter,
        Self::DamagedImage,
        Self::UnfitImage,
        Self::Overloaded,
        Self::Internal,
        Self::WarmingUp,
        Self::ShuttingDown,
        Self::Timeout,
    ];

    /// Name, status and title.
    fn row(self) -> (&'static str, StatusCode, &'static str) {
        use StatusCode as Status;
        match self {
            Self::MalformedRequest => (
                "malformed-request",
                Status::BAD_REQUEST,
                "The request is malformed",
            ),
            Self::UnknownParameter => (
                "unknown-parameter",
                Status::BAD_REQUEST,
                "There is no such parameter",
            ),
            Self::RepeatedParameter => (
                "repeated-parameter",
                Status::BAD_REQUEST,
                "A parameter is given twice",
            ),
            Self::MissingImage => ("missing-image", Status::BAD_REQUEST, "No frame was sent"),
            Self::NotFound => ("not-found", Status::NOT_FOUND, "There is nothing here"),
            Self::UnknownCalibration => (
                "unknown-calibration",
                Status::NOT_FOUND,
                "There is no such calibration",
            ),
            Self::UnknownModel => ("unknown-model", Status::NOT_FOUND, "There is no such model"),
            Self::MethodNotAllowed => (
                "method-not-allowed",
                Status::METHOD_NOT_ALLOWED,
                "The method is not offered",
            ),
            Self::SlowUpload => (
                "slow-upload",
                Status::REQUEST_TIMEOUT,
                "The body took too long to arrive",
            ),
            Self::BodyTooLarge => (
                "body-too-large",
                Status::PAYLOAD_TOO_LARGE,
                "The body is too large",
            ),
            Self::ImageTooLarge => (
                "image-too-large",
                Status::PAYLOAD_TOO_LARGE,
                "The frame has too many pixels",
            ),
            Self::UnsupportedImage => (
                "unsupported-image",
                Status::UNSUPPORTED_MEDIA_TYPE,
                "The frame is not in a format that can be read",
            ),
            Self::InvalidParameter => (
                "invalid-parameter",
                Status::UNPROCESSABLE_ENTITY,
                "A parameter cannot be used",
            ),
            Self::DamagedImage => (
                "damaged-image",
                Status::UNPROCESSABLE_ENTITY,
                "The frame is damaged or cut off",
            ),
            Self::UnfitImage => (
                "unfit-image",
                Status::UNPROCESSABLE_ENTITY,
                "The frame does not fit",
            ),
            Self::Overloaded => (
                "overloaded",
                Status::TOO_MANY_REQUESTS,
                "Too many frames are waiting",
            ),
            Self::Internal => (
                "internal",
                Status::INTERNAL_SERVER_ERROR,
                "There is a fault in the server",
            ),
            Self::WarmingUp => (
                "warming-up",
                Status::SERVICE_UNAVAILABLE,
                "The server is warming up",
            ),
            Self::ShuttingDown => (
                "shutting-down",
                Status::SERVICE_UNAVAILABLE,
                "The server is shutting down",
            ),
            Self::Timeout => (
                "timeout",
                Status::GATEWAY_TIMEOUT,
                "The deadline has passed",
            ),
        }
    }

    /// The short name: the end of the URN, and the metrics' label.
    pub(in crate::api) fn name(self) -> &'static str {
        self.row().0
    }

    /// Identifies the kind to programs.
    pub(in crate::api) fn urn(self) -> String {
        format!("urn:lookdown:problem:{}", self.name())
    }

    /// The HTTP status.
    pub(in crate::api) fn status(self) -> StatusCode {
        self.row().1
    }

    /// The kind in words.
    pub(in crate::api) fn title(self) -> &'static str {
        self.row().2
    }

    /// How long to wait before trying again, where that helps, seconds.
    pub(in crate::api) fn retry_after_seconds(self) -> Option<u32> {
        matches!(
            self,
            Self::Overloaded | Self::WarmingUp | Self::ShuttingDown
        )
        .then_some(1)
    }
}

//! The table of problem kinds. A new kind is one entry here and nothing else: its OpenAPI
//! description, its documentation page, its metric label and its row in docs/http.md follow
//! from the entry.

use axum::http::StatusCode;

/// Declares the kinds: a description, then
/// `Variant = STATUS "name" "Title" [retry_after_seconds N] => "Remedy.";`.
macro_rules! problems {
    ($(
        $(#[doc = $description:literal])+
        $kind:ident = $status:ident $name:literal $title:literal
            $(retry_after_seconds $seconds:literal)? => $remedy:literal;
    )+) => {
        /// A kind of problem.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Kind {
            $($(#[doc = $description])+ $kind,)+
        }

        impl Kind {
            /// Every kind, in the order of the table.
            pub const ALL: &[Self] = &[$(Self::$kind),+];

            /// The entry of the table.
            pub fn entry(self) -> Entry {
                match self {
                    $(Self::$kind => Entry {
                        name: $name,
                        status: StatusCode::$status,
                        title: $title,
                        description: concat!($($description),+).trim_ascii_start(),
                        remedy: $remedy,
                        retry_after_seconds: None $(.or(Some($seconds)))?,
                    },)+
                }
            }
        }
    };
}

/// One row of the table.
pub struct Entry {
    pub name: &'static str,
    pub status: StatusCode,
    pub title: &'static str,
    pub description: &'static str,
    pub remedy: &'static str,
    pub retry_after_seconds: Option<u64>,
}

problems! {
    /// The request does not follow the format of its endpoint.
    MalformedRequest = BAD_REQUEST "malformed-request" "Malformed request"
        => "Compare the request with `/docs`.";
    /// The request has a parameter or form field that the endpoint does not have.
    UnknownParameter = BAD_REQUEST "unknown-parameter" "Unknown parameter"
        => "Check the spelling: `detail` lists the known names.";
    /// The request has a parameter or the frame more than once.
    RepeatedParameter = BAD_REQUEST "repeated-parameter" "Repeated parameter"
        => "Send it once, either as a form field or in the query.";
    /// The request has no frame.
    MissingImage = BAD_REQUEST "missing-image" "Missing image"
        => "Send the frame as the form field `img` or as the request body.";
    /// The request has no API key, or one that is not valid.
    KeyRequired = UNAUTHORIZED "key-required" "Authentication required"
        => "Send one key that `access.keys_file` lists.";
    /// The client is not allowed to do this.
    Forbidden = FORBIDDEN "forbidden" "Permission denied"
        => "Use a key with the scope that `detail` names; check `access.cors_origins` for web pages and \
            `calibrations.writable` for changes of calibrations.";
    /// The path has no resource.
    NotFound = NOT_FOUND "not-found" "Not found"
        => "Check the path: `/docs` lists all of them.";
    /// The calibration does not exist, or its file cannot be used.
    UnknownCalibration = NOT_FOUND "unknown-calibration" "Unknown calibration"
        => "`GET /calibrations` lists all calibrations, and the reason for each that cannot be used.";
    /// The result store has no report of the camera.
    UnknownCamera = NOT_FOUND "unknown-camera" "Unknown camera"
        => "`GET /results` lists the cameras that have reports.";
    /// The result store has no image of the camera.
    ImageNotKept = NOT_FOUND "image-not-kept" "Image not stored"
        => "Add the camera to `results.images`.";
    /// The model is not loaded.
    UnknownModel = NOT_FOUND "unknown-model" "Unknown model"
        => "Name a model that `detail` lists.";
    /// The path does not support the method.
    MethodNotAllowed = METHOD_NOT_ALLOWED "method-not-allowed" "Method not allowed"
        => "Use a method that the header `Allow` lists.";
    /// The response has no format that the header `Accept` allows.
    NotAcceptable = NOT_ACCEPTABLE "not-acceptable" "Not acceptable"
        => "Send an `Accept` header with a format that `detail` lists, omit the header, or set the parameter \
            `format`.";
    /// The request body took too long to arrive.
    SlowUpload = REQUEST_TIMEOUT "slow-upload" "Request timeout"
        => "Send smaller frames; see `limits.min_upload_bytes_per_second` and `server.request_timeout_millis`.";
    /// The calibration shares its file with other calibrations.
    CalibrationConflict = CONFLICT "calibration-conflict" "Calibration conflict"
        => "Change the file itself.";
    /// The camera is one of the settings.
    CameraConflict = CONFLICT "camera-conflict" "Camera conflict"
        => "Change the camera in the settings file.";
    /// The resource has another revision than the request requires.
    PreconditionFailed = PRECONDITION_FAILED "precondition-failed" "Precondition failed"
        => "Get the resource again, and send its new `ETag` as `If-Match`.";
    /// The request body has too many bytes.
    BodyTooLarge = PAYLOAD_TOO_LARGE "body-too-large" "Request body too large"
        => "Send a smaller frame, or raise `server.max_body_bytes`.";
    /// The frame has too many pixels.
    ImageTooLarge = PAYLOAD_TOO_LARGE "image-too-large" "Image too large"
        => "Scale the frame down, or raise `limits.max_image_pixels`.";
    /// The frame has a format that the server cannot decode.
    UnsupportedImage = UNSUPPORTED_MEDIA_TYPE "unsupported-image" "Unsupported media type"
        => "Send JPEG, PNG or WebP.";
    /// The content is not a valid calibration.
    InvalidCalibration = UNPROCESSABLE_ENTITY "invalid-calibration" "Invalid calibration"
        => "`lookdown calibration check FILE` explains the reason.";
    /// A parameter or form field has a value that cannot be used.
    InvalidParameter = UNPROCESSABLE_ENTITY "invalid-parameter" "Invalid parameter"
        => "Send a value that `detail` allows.";
    /// A tensor does not match the metadata of the model.
    InvalidTensor = UNPROCESSABLE_ENTITY "invalid-tensor" "Invalid tensor"
        => "Compare the tensor with `GET /v2/models/NAME` and `detail`.";
    /// The frame is truncated or corrupt.
    DamagedImage = UNPROCESSABLE_ENTITY "damaged-image" "Corrupt image"
        => "Send the complete file.";
    /// The frame does not match the calibration, or its size cannot be processed.
    UnfitImage = UNPROCESSABLE_ENTITY "unfit-image" "Image does not match"
        => "Use the calibration of this camera, and frames of its aspect ratio.";
    /// The queue of frames, or the memory for request bodies, is full.
    Overloaded = TOO_MANY_REQUESTS "overloaded" "Server overloaded" retry_after_seconds 1
        => "Retry after `Retry-After`; send fewer frames at a time, or use a faster profile.";
    /// The server has too many event streams and waiting requests.
    TooManyListeners = TOO_MANY_REQUESTS "too-many-listeners" "Too many subscribers" retry_after_seconds 1
        => "Retry after `Retry-After`, omit `wait`, or raise `results.max_listeners`.";
    /// The client sends more requests than its rate limit allows.
    RateLimited = TOO_MANY_REQUESTS "rate-limited" "Too many requests" retry_after_seconds 1
        => "Retry after `Retry-After`, or raise `limits.requests_per_second`.";
    /// The request has too many headers, or too long ones.
    HeadersTooLarge = REQUEST_HEADER_FIELDS_TOO_LARGE "headers-too-large" "Request header fields too large"
        => "Send fewer and shorter headers and a shorter path, or raise `server.max_headers` and \
            `server.max_header_bytes`.";
    /// The server failed to process the request.
    Internal = INTERNAL_SERVER_ERROR "internal" "Internal server error"
        => "Search the log for the `request_id`, and report the error.";
    /// The result store does not respond.
    ResultsUnreachable = SERVICE_UNAVAILABLE "results-unreachable" "Result store unavailable" retry_after_seconds 1
        => "Retry after `Retry-After`; the log and `/readyz` report the error of Redis.";
    /// The counts are being started, or `lookdown count` does not respond.
    CountsUnavailable = SERVICE_UNAVAILABLE "counts-unavailable" "Counts unavailable" retry_after_seconds 1
        => "Retry after `Retry-After`; check the program at `counts.url`, and `counts.api_key_file`.";
    /// The calibration store does not respond.
    CalibrationsUnreachable = SERVICE_UNAVAILABLE "calibrations-unreachable" "Calibration store unavailable"
        retry_after_seconds 1
        => "Retry after `Retry-After`; check the folder and its mount.";
    /// The inference server does not respond.
    InferenceUnavailable = SERVICE_UNAVAILABLE "inference-unavailable" "Inference server unavailable"
        retry_after_seconds 1
        => "Retry after `Retry-After`; check the server at `inference.url`.";
    /// The server is starting, and its models are not ready yet.
    WarmingUp = SERVICE_UNAVAILABLE "warming-up" "Service unavailable" retry_after_seconds 1
        => "Wait until `/readyz` responds with 200.";
    /// The server is shutting down.
    ShuttingDown = SERVICE_UNAVAILABLE "shutting-down" "Server shutting down" retry_after_seconds 1
        => "Send the request to another server.";
    /// No frame makes progress: the workers or the network are stuck.
    Stalled = SERVICE_UNAVAILABLE "stalled" "Service unavailable" retry_after_seconds 1
        => "Search the log for the frames without progress; restart the server if it stays so.";
    /// The deadline of the request has passed.
    Timeout = GATEWAY_TIMEOUT "timeout" "Gateway timeout"
        => "Use a faster profile, send fewer frames at a time, or raise `timeout_millis`.";
}

impl Kind {
    /// Returns the kind of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        let mut kinds = Self::ALL.iter().copied();
        kinds.find(|kind| kind.name() == name)
    }

    /// The stable name: the end of the path, and the label of metrics.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// The path of the documentation, which identifies the kind to programs: `type` of a problem
    /// document.
    pub fn path(self) -> String {
        format!("/problems/{}", self.name())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn names_are_unique_and_fit_into_a_path() {
        let names: BTreeSet<_> = Kind::ALL.iter().map(|kind| kind.name()).collect();
        assert_eq!(names.len(), Kind::ALL.len());
        for name in names {
            let fits = |c: char| c.is_ascii_lowercase() || c == '-';
            assert!(name.chars().all(fits), "{name}");
            let found = Kind::from_name(name).unwrap();
            assert_eq!(found.path(), format!("/problems/{name}"));
        }
    }

    #[test]
    fn every_kind_has_an_error_status_and_full_sentences() {
        for kind in Kind::ALL {
            let status = kind.entry().status;
            assert!(
                status.is_client_error() || status.is_server_error(),
                "{kind:?}"
            );
            for sentence in [kind.entry().description, kind.entry().remedy] {
                assert!(sentence.ends_with('.'), "{sentence}");
                // Cells of a table and HTML text need no escapes.
                assert!(!sentence.contains(['|', '<', '>', '&']), "{sentence}");
            }
        }
    }
}

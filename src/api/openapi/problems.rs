//! The problems that a route answers, grouped by status.

use std::collections::BTreeMap;

use axum::http::StatusCode;
use utoipa::{
    IntoResponses, PartialSchema, ToSchema,
    openapi::{
        ContentBuilder, HeaderBuilder, Ref, RefOr, Response, ResponseBuilder, ResponsesBuilder,
    },
};

use crate::api::{
    deepstack,
    problem::{ProblemBody, ProblemKind},
};

/// What can go wrong with a frame.
pub(in crate::api) struct DetectProblems;

impl IntoResponses for DetectProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        responses(of_frames().filter(|kind| *kind != ProblemKind::InvalidTensor))
    }
}

/// What can go wrong with a frame or views that come as tensors.
pub(in crate::api) struct InferProblems;

impl IntoResponses for InferProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        let of_forms = [ProblemKind::MissingImage, ProblemKind::NotAcceptable];
        responses(of_frames().filter(|kind| !of_forms.contains(kind)))
    }
}

/// What can go wrong with frames, however they are sent.
fn of_frames() -> impl Iterator<Item = ProblemKind> {
    // Those of other routes, and those of connections, which are of no route.
    let others = |kind: &ProblemKind| {
        matches!(
            kind,
            ProblemKind::HeadersTooLarge
                | ProblemKind::TooManyConnections
                | ProblemKind::NotFound
                | ProblemKind::MethodNotAllowed
                | ProblemKind::UnknownCamera
                | ProblemKind::PictureNotKept
                | ProblemKind::TooManyListeners
                | ProblemKind::InvalidCalibration
                | ProblemKind::CalibrationConflict
                | ProblemKind::CalibrationsUnreachable
                | ProblemKind::ResultsUnreachable
                | ProblemKind::Outdated
                | ProblemKind::ModelConflict
                | ProblemKind::ModelRefused
                | ProblemKind::ModelBusy
        )
    };
    ProblemKind::ALL
        .into_iter()
        .filter(move |kind| !others(kind))
}

/// What can go wrong with a model's metadata.
pub(in crate::api) struct ModelProblems;

const OF_MODELS: [ProblemKind; 5] = [
    ProblemKind::MalformedRequest,
    ProblemKind::KeyRequired,
    ProblemKind::Forbidden,
    ProblemKind::UnknownModel,
    ProblemKind::RateLimited,
];

impl IntoResponses for ModelProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        responses(OF_MODELS)
    }
}

/// What can go wrong with a model's readiness.
pub(in crate::api) struct ModelReadyProblems;

impl IntoResponses for ModelReadyProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        responses(OF_MODELS.into_iter().chain(NOT_READY))
    }
}

/// What can go wrong with a frame of a client of DeepStack.
pub(in crate::api) struct DeepStackProblems;

impl IntoResponses for DeepStackProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        responses_with(OF_DEEPSTACK, deepstack::status_of)
    }
}

/// The same where the calibration is named.
pub(in crate::api) struct DeepStackCustomProblems;

impl IntoResponses for DeepStackCustomProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        let kinds = OF_DEEPSTACK.into_iter();
        let kinds = kinds.chain([ProblemKind::UnknownCalibration]);
        responses_with(kinds, deepstack::status_of)
    }
}

const OF_DEEPSTACK: [ProblemKind; 19] = [
    ProblemKind::MalformedRequest,
    ProblemKind::RepeatedParameter,
    ProblemKind::MissingImage,
    ProblemKind::KeyRequired,
    ProblemKind::Forbidden,
    ProblemKind::SlowUpload,
    ProblemKind::BodyTooLarge,
    ProblemKind::ImageTooLarge,
    ProblemKind::UnsupportedImage,
    ProblemKind::InvalidParameter,
    ProblemKind::DamagedImage,
    ProblemKind::UnfitImage,
    ProblemKind::Overloaded,
    ProblemKind::RateLimited,
    ProblemKind::Internal,
    ProblemKind::InferenceUnavailable,
    ProblemKind::WarmingUp,
    ProblemKind::ShuttingDown,
    ProblemKind::Timeout,
];

/// Why a server takes no frames now.
const NOT_READY: [ProblemKind; 3] = [
    ProblemKind::InferenceUnavailable,
    ProblemKind::WarmingUp,
    ProblemKind::ShuttingDown,
];

/// The server takes no frames now.
pub(in crate::api) struct NotReadyProblems;

impl IntoResponses for NotReadyProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        responses(NOT_READY)
    }
}

/// What can go wrong with listing the models.
pub(in crate::api) struct IndexProblems;

/// What can go wrong with every request that brings a small body.
const OF_ADMINISTRATION: [ProblemKind; 9] = [
    ProblemKind::MalformedRequest,
    ProblemKind::KeyRequired,
    ProblemKind::Forbidden,
    ProblemKind::SlowUpload,
    ProblemKind::BodyTooLarge,
    ProblemKind::Overloaded,
    ProblemKind::RateLimited,
    ProblemKind::Internal,
    ProblemKind::Timeout,
];

impl IntoResponses for IndexProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        responses(OF_ADMINISTRATION)
    }
}

/// What can go wrong with loading or unloading a model.
pub(in crate::api) struct LoadProblems;

impl IntoResponses for LoadProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        let of_models = [
            ProblemKind::UnknownModel,
            ProblemKind::ModelConflict,
            ProblemKind::ModelRefused,
            ProblemKind::ModelBusy,
            ProblemKind::InferenceUnavailable,
        ];
        responses(OF_ADMINISTRATION.into_iter().chain(of_models))
    }
}

/// What can go wrong with every request of a reader.
const OF_READING: [ProblemKind; 4] = [
    ProblemKind::MalformedRequest,
    ProblemKind::KeyRequired,
    ProblemKind::Forbidden,
    ProblemKind::RateLimited,
];

/// What can go wrong with listing calibrations.
pub(in crate::api) struct ReadProblems;

impl IntoResponses for ReadProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        responses([
            ProblemKind::KeyRequired,
            ProblemKind::Forbidden,
            ProblemKind::RateLimited,
        ])
    }
}

/// What can go wrong with listing the cameras that have reports.
pub(in crate::api) struct ResultsProblems;

impl IntoResponses for ResultsProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        responses([
            ProblemKind::KeyRequired,
            ProblemKind::Forbidden,
            ProblemKind::ResultsUnreachable,
            ProblemKind::RateLimited,
        ])
    }
}

/// What can go wrong with reading a calibration.
pub(in crate::api) struct UnknownCalibrationProblem;

impl IntoResponses for UnknownCalibrationProblem {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        responses(
            OF_READING
                .into_iter()
                .chain([ProblemKind::UnknownCalibration]),
        )
    }
}

/// What can go wrong with the latest report of a camera.
pub(in crate::api) struct LatestProblems;

impl IntoResponses for LatestProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        let of_waiting = [
            ProblemKind::UnknownParameter,
            ProblemKind::RepeatedParameter,
            ProblemKind::UnknownCamera,
            ProblemKind::InvalidParameter,
            ProblemKind::TooManyListeners,
            ProblemKind::ResultsUnreachable,
            ProblemKind::ShuttingDown,
        ];
        responses(OF_READING.into_iter().chain(of_waiting))
    }
}

/// What can go wrong with the latest picture of a camera.
pub(in crate::api) struct PictureProblems;

impl IntoResponses for PictureProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        let of_pictures = [
            ProblemKind::UnknownParameter,
            ProblemKind::RepeatedParameter,
            ProblemKind::UnknownCamera,
            ProblemKind::PictureNotKept,
            ProblemKind::InvalidParameter,
            ProblemKind::Overloaded,
            ProblemKind::Internal,
            ProblemKind::ResultsUnreachable,
            ProblemKind::ShuttingDown,
            ProblemKind::Timeout,
        ];
        responses(OF_READING.into_iter().chain(of_pictures))
    }
}

/// What can go wrong with the reports of a camera.
pub(in crate::api) struct HistoryProblems;

impl IntoResponses for HistoryProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        let of_pages = [
            ProblemKind::UnknownParameter,
            ProblemKind::RepeatedParameter,
            ProblemKind::UnknownCamera,
            ProblemKind::InvalidParameter,
            ProblemKind::ResultsUnreachable,
        ];
        responses(OF_READING.into_iter().chain(of_pages))
    }
}

/// What can go wrong with listening.
const OF_LISTENING: [ProblemKind; 6] = [
    ProblemKind::KeyRequired,
    ProblemKind::Forbidden,
    ProblemKind::TooManyListeners,
    ProblemKind::ResultsUnreachable,
    ProblemKind::RateLimited,
    ProblemKind::ShuttingDown,
];

/// What can go wrong with listening to a camera.
pub(in crate::api) struct CameraEventsProblems;

impl IntoResponses for CameraEventsProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        responses(OF_LISTENING.into_iter().chain([ProblemKind::UnknownCamera]))
    }
}

/// What can go wrong with listening to all cameras.
pub(in crate::api) struct EventsProblems;

impl IntoResponses for EventsProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        responses(OF_LISTENING)
    }
}

/// What can go wrong with creating or replacing a calibration.
pub(in crate::api) struct ChangeProblems;

impl IntoResponses for ChangeProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        let of_changes = [
            ProblemKind::UnknownParameter,
            ProblemKind::RepeatedParameter,
            ProblemKind::InvalidCalibration,
            ProblemKind::CalibrationConflict,
            ProblemKind::CalibrationsUnreachable,
            ProblemKind::Outdated,
            ProblemKind::InvalidParameter,
        ];
        responses(OF_ADMINISTRATION.into_iter().chain(of_changes))
    }
}

/// What can go wrong with deleting a calibration.
pub(in crate::api) struct DeleteProblems;

impl IntoResponses for DeleteProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        responses([
            ProblemKind::MalformedRequest,
            ProblemKind::KeyRequired,
            ProblemKind::Forbidden,
            ProblemKind::UnknownCalibration,
            ProblemKind::CalibrationConflict,
            ProblemKind::CalibrationsUnreachable,
            ProblemKind::Outdated,
            ProblemKind::RateLimited,
            ProblemKind::Internal,
            ProblemKind::Timeout,
        ])
    }
}

/// What can go wrong with a view plan.
pub(in crate::api) struct ViewsProblems;

impl IntoResponses for ViewsProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        let of_views = [
            ProblemKind::UnknownParameter,
            ProblemKind::RepeatedParameter,
            ProblemKind::UnknownCalibration,
            ProblemKind::InvalidParameter,
            ProblemKind::Internal,
            ProblemKind::WarmingUp,
            ProblemKind::Timeout,
        ];
        responses(OF_READING.into_iter().chain(of_views))
    }
}

/// What can go wrong with trying a calibration.
pub(in crate::api) struct TrialProblems;

impl IntoResponses for TrialProblems {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        let of_trials = [
            ProblemKind::UnknownParameter,
            ProblemKind::RepeatedParameter,
            ProblemKind::InvalidCalibration,
            ProblemKind::InvalidParameter,
            ProblemKind::WarmingUp,
        ];
        responses(OF_ADMINISTRATION.into_iter().chain(of_trials))
    }
}

/// A fault of ours.
pub(in crate::api) struct FaultProblem;

impl IntoResponses for FaultProblem {
    fn responses() -> BTreeMap<String, RefOr<Response>> {
        responses([ProblemKind::Internal])
    }
}

fn responses(kinds: impl IntoIterator<Item = ProblemKind>) -> BTreeMap<String, RefOr<Response>> {
    responses_with(kinds, ProblemKind::status)
}

fn responses_with(
    kinds: impl IntoIterator<Item = ProblemKind>,
    status_of: impl Fn(ProblemKind) -> StatusCode,
) -> BTreeMap<String, RefOr<Response>> {
    let mut by_status: BTreeMap<String, Vec<ProblemKind>> = BTreeMap::new();
    for kind in kinds {
        by_status
            .entry(status_of(kind).as_str().to_owned())
            .or_default()
            .push(kind);
    }
    let responses = by_status
        .into_iter()
        .map(|(status, kinds)| (status, response(&kinds)));
    ResponsesBuilder::new()
        .responses_from_iter(responses)
        .build()
        .responses
}

/// One response for all kinds that share a status.
fn response(kinds: &[ProblemKind]) -> Response {
    let lines = kinds
        .iter()
        .map(|kind| format!("{} (`{}`).", kind.title(), kind.urn()));
    let schema = Ref::from_schema_name(ProblemBody::name());
    let content = ContentBuilder::new().schema(Some(schema)).build();
    let mut response = ResponseBuilder::new()
        .description(lines.collect::<Vec<_>>().join(" "))
        .content("application/problem+json", content);
    if kinds.contains(&ProblemKind::KeyRequired) {
        let bearer = HeaderBuilder::new()
            .schema(Some(String::schema()))
            .description(Some("`Bearer`."))
            .build();
        response = response.header("WWW-Authenticate", bearer);
    }
    if kinds.contains(&ProblemKind::RateLimited) {
        for (name, description) in [
            ("RateLimit-Policy", "How often a client may ask."),
            ("RateLimit", "How often it may now, if there is a limit."),
        ] {
            let header = HeaderBuilder::new()
                .schema(Some(String::schema()))
                .description(Some(description))
                .build();
            response = response.header(name, header);
        }
    }
    if kinds
        .iter()
        .all(|kind| kind.retry_after_seconds().is_none())
    {
        return response.build();
    }
    let retry_after = HeaderBuilder::new()
        .schema(Some(u32::schema()))
        .description(Some("Seconds to wait before trying again."))
        .build();
    response.header("Retry-After", retry_after).build()
}

//! The problems that a route answers, grouped by status.

mod frames;
mod results;

use std::collections::BTreeMap;

use axum::http::StatusCode;
use utoipa::{
    IntoResponses, PartialSchema, ToSchema,
    openapi::{
        ContentBuilder, HeaderBuilder, Ref, RefOr, Response, ResponseBuilder, ResponsesBuilder,
    },
};

pub(in crate::api) use frames::{
    DeepStackCustomProblems, DeepStackProblems, DetectProblems, InferProblems, ModelProblems,
    ModelReadyProblems,
};
pub(in crate::api) use results::{
    CameraEventsProblems, EventsProblems, HistoryProblems, LatestProblems, PictureProblems,
    ResultsProblems,
};

use crate::api::problem::{ProblemBody, ProblemKind};

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
            ProblemKind::Overloaded,
            ProblemKind::Internal,
            ProblemKind::WarmingUp,
            ProblemKind::ShuttingDown,
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
            ProblemKind::ShuttingDown,
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

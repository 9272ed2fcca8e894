//! What can go wrong with results.

use std::collections::BTreeMap;

use utoipa::{
    IntoResponses,
    openapi::{RefOr, Response},
};

use super::{OF_READING, responses};
use crate::api::problem::ProblemKind;

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

//! What can go wrong with frames and views, however they are sent.

use std::collections::BTreeMap;

use utoipa::{
    IntoResponses,
    openapi::{RefOr, Response},
};

use super::{NOT_READY, responses, responses_with};
use crate::api::{deepstack, problem::ProblemKind};

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

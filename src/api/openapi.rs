//! The API's own description. What a route takes and answers stands with the route; here is what
//! they share.

mod parameters;
mod problems;
mod security;

use axum::Json;
use utoipa::{OpenApi, openapi};

use security::Keys;

pub(super) use parameters::{DetectForm, DetectQuery, PictureQuery, RawBytes, fields};
pub(super) use problems::{
    CameraEventsProblems, ChangeProblems, DeepStackCustomProblems, DeepStackProblems,
    DeleteProblems, DetectProblems, EventsProblems, FaultProblem, HistoryProblems, IndexProblems,
    InferProblems, LatestProblems, LoadProblems, ModelProblems, ModelReadyProblems,
    NotReadyProblems, PictureProblems, ReadProblems, ResultsProblems, TrialProblems,
    UnknownCalibrationProblem, ViewsProblems,
};

use super::problem::ProblemBody;

#[derive(OpenApi)]
#[openapi(
    info(
        title = "Lookdown",
        description = "Finds people in the pictures of ceiling fisheye cameras. Any request may also \
                       be answered 431 when its headers are too large, and 503 when too many \
                       connections are open."
    ),
    servers((url = "/", description = "This server")),
    tags(
        (name = "detection", description = "Frames in, persons out."),
        (name = "deepstack", description = "The same for clients of DeepStack, such as Home Assistant and Blue Iris."),
        (name = "inference", description = "The same for clients of the Open Inference Protocol (KServe V2)."),
        (name = "results", description = "What was found last, for dashboards. Kept within limits, in memory or in a Redis that servers share."),
        (name = "calibrations", description = "The cameras. Changes are for administrators."),
        (name = "models", description = "Which models answer. Changes are for administrators."),
        (name = "operation", description = "Probes, metrics and this document."),
    ),
    components(schemas(ProblemBody)),
    modifiers(&Keys)
)]
pub(super) struct Common;

/// The OpenAPI document of every route.
#[must_use]
pub fn document() -> openapi::OpenApi {
    super::routes().into_openapi()
}

/// This document.
#[utoipa::path(
    get, path = "/openapi.json", tag = "operation", operation_id = "get_openapi",
    responses((status = OK, description = "OpenAPI 3.1.", body = Object))
)]
pub(super) async fn openapi_json() -> Json<openapi::OpenApi> {
    Json(document())
}

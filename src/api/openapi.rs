//! The API's own description. What a route takes and answers stands with the route; here is what
//! they share.

mod failures;
mod parameters;
mod security;

use axum::Json;
use utoipa::{OpenApi, openapi};

use security::Keys;

use super::problem::ProblemBody;
pub(super) use parameters::{DetectForm, DetectQuery, PictureQuery, RawBytes, fields};

#[derive(OpenApi)]
#[openapi(
    info(
        title = "Lookdown",
        description = "Finds people in the frames of ceiling fisheye cameras. Every failure is a \
                       problem document (RFC 9457)."
    ),
    servers((url = "/", description = "This server")),
    tags(
        (name = "detection", description = "Frames in, persons out."),
        (name = "deepstack", description = "The same for clients of DeepStack, such as Home Assistant and Blue Iris."),
        (name = "inference", description = "The same for clients of the Open Inference Protocol (KServe V2)."),
        (name = "results", description = "What was found last, for dashboards. Kept within limits, in memory or in a Redis that servers share."),
        (name = "calibrations", description = "The cameras. Changes are for administrators."),
        (name = "models", description = "Which models answer. Changes are for administrators."),
        (name = "operation", description = "Probes, metrics and documentation."),
    ),
    components(schemas(ProblemBody)),
    modifiers(&Keys)
)]
pub(super) struct Common;

/// The OpenAPI document of every route.
#[must_use]
pub fn document() -> openapi::OpenApi {
    let mut document = super::routes().into_openapi();
    failures::describe(&mut document);
    document
}

/// This document.
#[utoipa::path(
    get, path = "/openapi.json", tag = "operation", operation_id = "get_openapi",
    responses((status = OK, description = "OpenAPI 3.1.", body = Object))
)]
pub(super) async fn openapi_json() -> Json<openapi::OpenApi> {
    Json(document())
}

//! The OpenAPI document. Each route describes its own parameters and responses. This module adds
//! the common parts.

mod examples;
mod media_types;
mod parameters;

use lookdown_http::openapi::Keys;
use utoipa::{OpenApi, openapi};

use crate::api::http::problem::ProblemBody;
pub use media_types::Document;
pub(super) use parameters::{
    AnnotationQuery, CalibratedDetectionQuery, DetectForm, DetectQuery, DetectionQuery, RawBytes,
    fields,
};

#[derive(OpenApi)]
#[openapi(
    info(
        title = "Lookdown",
        description = "Detects persons in the frames of ceiling fisheye cameras. Every failure is a \
                       problem document (RFC 9457).",
        contact(name = "The Lookdown authors")
    ),
    external_docs(url = "/problems", description = "Problems and their remedies"),
    servers((url = "/", description = "This server")),
    tags(
        (name = "detection", description = "Frames in, persons out."),
        (name = "deepstack", description = "Detection for clients of DeepStack, such as Home Assistant and Blue Iris."),
        (name = "inference", description = "Detection for clients of the Open Inference Protocol (KServe V2)."),
        (name = "results", description = "Stored reports and images, for dashboards. In memory or in a shared Redis, within limits."),
        (name = "calibrations", description = "Calibrations of the cameras. Changes need the scope `admin`."),
        (name = "cameras", description = "Cameras of `lookdown run`. Changes need the scope `admin`."),
        (name = "operation", description = "Health checks, metrics and documentation."),
    ),
    components(schemas(ProblemBody)),
    modifiers(&Keys)
)]
pub(super) struct Common;

/// Adds the failures, and the operations that need no key, to the document of the routes.
pub(super) fn complete(mut document: openapi::OpenApi) -> openapi::OpenApi {
    parameters::add_choices(document.components.get_or_insert_default());
    examples::add(&mut document);
    lookdown_http::openapi::complete(&mut document);
    document
}

//! The OpenAPI document. Each route describes its own parameters and responses. This module adds
//! the common parts.

mod examples;
mod parameters;

use indexmap::IndexMap;
use lookdown_http::openapi::Keys;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::openapi::{self, OpenApi};

use super::http::problem::ProblemBody;

pub(super) use parameters::{
    AnnotationQuery, CalibratedDetectionQuery, DetectForm, DetectQuery, DetectionQuery, RawBytes,
    fields,
};

#[derive(utoipa::OpenApi)]
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

const FORM: &str = "multipart/form-data";

/// The OpenAPI document as it is published: the form is the first media type of a body.
#[derive(Debug, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Document(Node);

#[derive(Debug, Serialize, Deserialize)]
#[serde(untagged)]
enum Node {
    Object(IndexMap<String, Node>),
    Array(Vec<Node>),
    Scalar(Value),
}

impl Document {
    /// Orders the media types of a document.
    ///
    /// # Errors
    /// A document that is not JSON.
    pub fn from_document(document: &OpenApi) -> serde_json::Result<Self> {
        let mut root: Node = serde_json::from_str(&document.to_json()?)?;
        root.put_forms_first();
        Ok(Self(root))
    }
}

impl Node {
    fn put_forms_first(&mut self) {
        match self {
            Self::Object(fields) => {
                if let Some(index) = fields.get_index_of(FORM) {
                    fields.move_index(index, 0);
                }
                fields.values_mut().for_each(Self::put_forms_first);
            }
            Self::Array(items) => items.iter_mut().for_each(Self::put_forms_first),
            Self::Scalar(_) => {}
        }
    }
}

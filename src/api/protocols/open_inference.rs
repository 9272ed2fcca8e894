//! The Open Inference Protocol (KServe V2) over HTTP, with tensors as JSON or as bytes after it
//! (the extension `binary_tensor_data`). Source: the repository `open-inference-protocol`, and the
//! extensions as Triton Inference Server describes them.
//!
//! The model `lookdown` accepts a frame and returns its persons. Each loaded detector accepts views
//! and returns its detections.

mod answer;
pub(in crate::api) mod describe;
mod detector;
mod document;
pub(in crate::api) mod infer;
mod metadata;
mod persons;
pub(in crate::api) mod repository;
mod request;
mod request_head;
mod tensor;
mod wanted;

use std::sync::Arc;

use crate::{
    api::{
        ApiState,
        http::problem::{Problem, ProblemKind},
    },
    inference::Model,
    quoted::Quoted,
};
use metadata::ModelMetadata;

/// The model that detects persons in frames.
const FRAME_MODEL: &str = "lookdown";
/// The version of its inputs and outputs.
const FRAME_MODEL_VERSION: &str = "1";

/// A model that accepts requests.
enum Asked {
    Frames,
    Views(Arc<Model>),
}

impl Asked {
    /// Returns the model of this name, and of this version, if one is named.
    fn find(state: &ApiState, name: &str, version: Option<&str>) -> Result<Self, Problem> {
        let unknown = |detail| Problem::new(ProblemKind::UnknownModel, detail);
        let found = if name == FRAME_MODEL {
            Self::Frames
        } else {
            let model = state.models.registry().get(name);
            Self::Views(model.ok_or_else(|| {
                let loaded = state.models.registry().all();
                let loaded: Vec<_> = loaded.iter().map(|model| model.name()).collect();
                let (name, loaded) = (Quoted(name), loaded.join(", "));
                unknown(format!(
                    "model: there is no model {name}: use {FRAME_MODEL}, which accepts frames, or one of \
                     the loaded detectors: {loaded}"
                ))
            })?)
        };
        match version {
            Some(wanted) if wanted != found.version() => {
                let (wanted, version) = (Quoted(wanted), found.version());
                Err(unknown(format!(
                    "model: {name} has the version {version}, but not {wanted}"
                )))
            }
            _ => Ok(found),
        }
    }

    fn version(&self) -> &str {
        match self {
            Self::Frames => FRAME_MODEL_VERSION,
            Self::Views(model) => model.revision(),
        }
    }

    fn metadata(&self) -> ModelMetadata {
        match self {
            Self::Frames => persons::metadata(),
            Self::Views(model) => detector::metadata(model),
        }
    }
}

//! The model of a request: by its name, and by its version where the path has one.

use std::sync::Arc;

use axum::{
    extract::{FromRequestParts, Path, rejection::PathRejection},
    http::request::Parts,
};
use lookdown_common::text::Quoted;
use lookdown_detect::{inference::Model, open_inference::metadata::ModelMetadata};
use serde::Deserialize;

use super::{
    detector,
    persons::{self, FRAME_MODEL, FRAME_MODEL_VERSION},
};
use crate::api::{
    ApiState,
    http::problem::{Problem, ProblemKind},
};

/// The address of a model: `/v2/models/{name}` or `/v2/models/{name}/versions/{version}`.
#[derive(Deserialize)]
pub(in crate::api) struct ModelAddress {
    pub(super) name: String,
    version: Option<String>,
}

impl FromRequestParts<ApiState> for ModelAddress {
    type Rejection = PathRejection;

    async fn from_request_parts(
        parts: &mut Parts,
        state: &ApiState,
    ) -> Result<Self, PathRejection> {
        let Path(address) = Path::from_request_parts(parts, state).await?;
        Ok(address)
    }
}

/// A model that accepts requests.
pub(super) enum RequestedModel {
    Frames,
    Views(Arc<Model>),
}

impl RequestedModel {
    /// Returns the model at an address.
    pub(super) fn find(state: &ApiState, address: &ModelAddress) -> Result<Self, Problem> {
        let (name, version) = (&*address.name, address.version.as_deref());
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

    pub(super) fn version(&self) -> &str {
        match self {
            Self::Frames => FRAME_MODEL_VERSION,
            Self::Views(model) => model.revision(),
        }
    }

    pub(super) fn metadata(&self) -> ModelMetadata {
        match self {
            Self::Frames => persons::metadata(),
            Self::Views(model) => detector::metadata(model),
        }
    }
}

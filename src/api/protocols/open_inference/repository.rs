//! The models of the server: the model repository extension of the Open Inference Protocol, as
//! Triton describes it. Changes need the scope `admin`.

mod body;

use axum::{
    Json,
    extract::{Path, State},
};
use lookdown_detect::inference::{
    InferenceError, Model, NotLoaded, RepositoryError, RepositoryRow,
};
use serde::Serialize;
use utoipa::ToSchema;

use crate::api::{
    ApiState,
    http::{
        deadline::{CALIBRATIONS_AND_MODELS, Deadline},
        problem::{Problem, ProblemKind},
    },
    require_scope::{RequireAdmin, RequireModelRead},
};
use body::{IndexRequest, LoadRequest, SmallBody, UnloadRequest};

/// A model of the repository.
#[derive(Serialize, ToSchema)]
#[schema(example = json!({ "name": "nanodet_g_views_416", "version": "3f1c22ab90de", "state": "READY" }))]
pub(in crate::api) struct RepositoryEntry {
    /// The name of the model.
    name: String,
    /// The revision in use, as in reports.
    #[serde(skip_serializing_if = "Option::is_none")]
    version: Option<String>,
    /// `READY` when the model is in use, else `UNAVAILABLE`.
    state: &'static str,
    /// The reason why the model is not in use, or why its last load failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
}

impl From<RepositoryRow> for RepositoryEntry {
    fn from(row: RepositoryRow) -> Self {
        let name = &row.name;
        let reason = row.reason.map(|reason| match reason {
            NotLoaded::NotRequested => {
                format!("it is not loaded: load it with POST /v2/repository/models/{name}/load")
            }
            NotLoaded::NoFile => format!(
                "its ONNX file is missing: run `make models` or `lookdown model fetch {name}`"
            ),
            NotLoaded::Failed(error) => error,
        });
        Self {
            state: if row.revision.is_some() {
                "READY"
            } else {
                "UNAVAILABLE"
            },
            name: row.name,
            version: row.revision,
            reason,
        }
    }
}

impl From<&Model> for RepositoryEntry {
    fn from(model: &Model) -> Self {
        Self::from(RepositoryRow {
            name: model.name().to_owned(),
            revision: Some(model.revision().to_owned()),
            reason: None,
        })
    }
}

/// List models
///
/// Returns the loaded models and the models of the repository folder that can be loaded.
#[utoipa::path(
    post, path = "/v2/repository/index", tag = "models", operation_id = "list_models",
    request_body(content = Option<IndexRequest>, description = "Optional."),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "The models, by name.", body = Vec<RepositoryEntry>),
    )
)]
pub(in crate::api) async fn index(
    State(state): State<ApiState>,
    _reader: RequireModelRead,
    deadline: Deadline,
    SmallBody(IndexRequest { ready }): SmallBody<IndexRequest>,
) -> Result<Json<Vec<RepositoryEntry>>, Problem> {
    let rows = deadline.blocking(move || Ok::<_, Problem>(state.models.rows()));
    let rows = rows.await?;
    let rows = rows
        .into_iter()
        .filter(|row| !ready || row.revision.is_some());
    Ok(Json(rows.map(RepositoryEntry::from).collect()))
}

/// Load a model
///
/// Loads or reloads a model. It comes into use after its check and a first run. Until then, and if
/// that fails, the current revision stays in use.
#[utoipa::path(
    post, path = "/v2/repository/models/{name}/load", tag = "models",
    operation_id = "load_model",
    params(("name" = String, Path, description = "The model's name.")),
    request_body(content = Option<LoadRequest>, description = "Optional."),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses(
        (status = OK, description = "The model is loaded.", body = RepositoryEntry),
    )
)]
pub(in crate::api) async fn load(
    State(state): State<ApiState>,
    _administrator: RequireAdmin,
    deadline: Deadline,
    Path(name): Path<String>,
    _: SmallBody<LoadRequest>,
) -> Result<Json<RepositoryEntry>, Problem> {
    let model = deadline
        .using(&CALIBRATIONS_AND_MODELS, move || state.models.load(&name))
        .await?;
    Ok(Json(RepositoryEntry::from(&*model)))
}

/// Unload a model
///
/// Frames that were accepted earlier still use it. The models of the profiles cannot be unloaded.
#[utoipa::path(
    post, path = "/v2/repository/models/{name}/unload", tag = "models",
    operation_id = "unload_model",
    params(("name" = String, Path, description = "The model's name.")),
    request_body(content = Option<UnloadRequest>, description = "Optional."),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses(
        (status = OK, description = "The model is unloaded.", body = RepositoryEntry),
    )
)]
pub(in crate::api) async fn unload(
    State(state): State<ApiState>,
    _administrator: RequireAdmin,
    deadline: Deadline,
    Path(name): Path<String>,
    _: SmallBody<UnloadRequest>,
) -> Result<Json<RepositoryEntry>, Problem> {
    let unloaded = name.clone();
    let unload = deadline.using(&CALIBRATIONS_AND_MODELS, move || {
        state.models.unload(&unloaded)
    });
    unload.await?;
    Ok(Json(RepositoryEntry::from(RepositoryRow {
        name,
        revision: None,
        reason: None,
    })))
}

impl From<RepositoryError> for Problem {
    fn from(error: RepositoryError) -> Self {
        let kind = match &error {
            RepositoryError::Unknown { .. } | RepositoryError::NotLoaded { .. } => {
                ProblemKind::UnknownModel
            }
            RepositoryError::Kept { .. } | RepositoryError::Full(_) => ProblemKind::ModelConflict,
            RepositoryError::Busy => ProblemKind::ModelBusy,
            RepositoryError::OtherName { .. } => ProblemKind::ModelRefused,
            RepositoryError::Refused { cause, .. } => match cause {
                InferenceError::RemoteBusy { .. } => ProblemKind::ModelBusy,
                InferenceError::Remote { .. } | InferenceError::RemoteDenied { .. } => {
                    ProblemKind::InferenceUnavailable
                }
                _ => ProblemKind::ModelRefused,
            },
        };
        Self::new(kind, error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_that_is_not_loaded_has_the_remedy() {
        for (reason, remedy) in [
            (NotLoaded::NotRequested, "POST /v2/repository/models/b/load"),
            (NotLoaded::NoFile, "`lookdown model fetch b`"),
            (NotLoaded::Failed("some error".to_owned()), "some error"),
        ] {
            let entry = RepositoryEntry::from(RepositoryRow {
                name: "b".to_owned(),
                revision: None,
                reason: Some(reason),
            });
            assert_eq!(entry.state, "UNAVAILABLE");
            let reason = entry.reason.unwrap();
            assert!(reason.contains(remedy), "{reason}");
        }
    }
}

//! Metadata and health checks of the server and its models.

use axum::{
    Json,
    extract::{Path, State},
};

use super::{
    Asked,
    metadata::{ModelMetadata, ModelReady, ServerLive, ServerMetadata, ServerReady},
};
use crate::api::{ApiState, http::problem::Problem, require_scope::RequireDetect};

/// Get server metadata
#[utoipa::path(
    get, path = "/v2", tag = "operation", operation_id = "get_server_metadata",
    responses((status = OK, description = "The name, version and extensions of the server.", body = ServerMetadata))
)]
pub(in crate::api) async fn server() -> Json<ServerMetadata> {
    Json(ServerMetadata::default())
}

/// Check liveness (Open Inference Protocol)
///
/// Equivalent to `/livez`.
#[utoipa::path(
    get, path = "/v2/health/live", tag = "operation", operation_id = "get_server_liveness",
    responses((status = OK, description = "The process is alive.", body = ServerLive))
)]
pub(in crate::api) async fn live() -> Json<ServerLive> {
    Json(ServerLive { live: true })
}

/// Check readiness (Open Inference Protocol)
///
/// Equivalent to `/readyz`.
#[utoipa::path(
    get, path = "/v2/health/ready", tag = "operation", operation_id = "get_server_readiness",
    responses(
        (status = OK, description = "The server accepts frames.", body = ServerReady),
    )
)]
pub(in crate::api) async fn ready(
    State(state): State<ApiState>,
) -> Result<Json<ServerReady>, Problem> {
    state.require_ready()?;
    Ok(Json(ServerReady { ready: true }))
}

/// Get model metadata
///
/// `lookdown` accepts a frame and returns persons; the detectors accept views.
#[utoipa::path(
    get, path = "/v2/models/{name}", tag = "inference", operation_id = "get_model",
    params(("name" = String, Path, description = "`lookdown`, or the name of a detector.")),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The inputs and outputs of the model.", body = ModelMetadata),
    )
)]
pub(in crate::api) async fn model(
    State(state): State<ApiState>,
    _finder: RequireDetect,
    Path(name): Path<String>,
) -> Result<Json<ModelMetadata>, Problem> {
    Ok(Json(Asked::find(&state, &name, None)?.metadata()))
}

/// Get metadata of a model version
#[utoipa::path(
    get, path = "/v2/models/{name}/versions/{version}", tag = "inference",
    operation_id = "get_model_version",
    params(
        ("name" = String, Path, description = "`lookdown`, or the name of a detector."),
        ("version" = String, Path, description = "The version in the metadata of the model."),
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The inputs and outputs of the model.", body = ModelMetadata),
    )
)]
pub(in crate::api) async fn model_version(
    State(state): State<ApiState>,
    _finder: RequireDetect,
    Path((name, version)): Path<(String, String)>,
) -> Result<Json<ModelMetadata>, Problem> {
    Ok(Json(Asked::find(&state, &name, Some(&version))?.metadata()))
}

/// Check the readiness of a model
#[utoipa::path(
    get, path = "/v2/models/{name}/ready", tag = "inference", operation_id = "get_model_readiness",
    params(("name" = String, Path, description = "`lookdown`, or the name of a detector.")),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "It can.", body = ModelReady),
    )
)]
pub(in crate::api) async fn model_ready(
    State(state): State<ApiState>,
    _finder: RequireDetect,
    Path(name): Path<String>,
) -> Result<Json<ModelReady>, Problem> {
    Asked::find(&state, &name, None)?;
    state.require_ready()?;
    Ok(Json(ModelReady { name, ready: true }))
}

/// Check readiness of a model version
#[utoipa::path(
    get, path = "/v2/models/{name}/versions/{version}/ready", tag = "inference",
    operation_id = "get_model_version_readiness",
    params(
        ("name" = String, Path, description = "`lookdown`, or the name of a detector."),
        ("version" = String, Path, description = "The version in the metadata of the model."),
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "It can.", body = ModelReady),
    )
)]
pub(in crate::api) async fn model_version_ready(
    State(state): State<ApiState>,
    _finder: RequireDetect,
    Path((name, version)): Path<(String, String)>,
) -> Result<Json<ModelReady>, Problem> {
    Asked::find(&state, &name, Some(&version))?;
    state.require_ready()?;
    Ok(Json(ModelReady { name, ready: true }))
}

//! What the server and its models tell of themselves, and whether they can be asked.

use axum::{
    Json,
    extract::{Path, State},
};

use super::{
    Asked,
    metadata::{ModelMetadata, ModelReady, ServerLive, ServerMetadata, ServerReady},
};
use crate::api::{ApiState, access::Finder, health::require_ready, problem::Problem};

/// What is this server?
#[utoipa::path(
    get, path = "/v2", tag = "operation", operation_id = "get_server_metadata",
    responses((status = OK, description = "Its name, version and extensions.", body = ServerMetadata))
)]
pub(in crate::api) async fn server() -> Json<ServerMetadata> {
    Json(ServerMetadata::default())
}

/// Is the process alive? As `/livez`, for clients of the Open Inference Protocol.
#[utoipa::path(
    get, path = "/v2/health/live", tag = "operation", operation_id = "get_server_liveness",
    responses((status = OK, description = "The process answers.", body = ServerLive))
)]
pub(in crate::api) async fn live() -> Json<ServerLive> {
    Json(ServerLive { live: true })
}

/// Can frames be sent? As `/readyz`, for clients of the Open Inference Protocol.
#[utoipa::path(
    get, path = "/v2/health/ready", tag = "operation", operation_id = "get_server_readiness",
    responses(
        (status = OK, description = "Frames can be sent.", body = ServerReady),
    )
)]
pub(in crate::api) async fn ready(
    State(state): State<ApiState>,
) -> Result<Json<ServerReady>, Problem> {
    require_ready(&state)?;
    Ok(Json(ServerReady { ready: true }))
}

/// What does a model take and answer?
///
/// `lookdown` takes a frame and answers with persons; the detectors take views.
#[utoipa::path(
    get, path = "/v2/models/{name}", tag = "inference", operation_id = "get_model",
    params(("name" = String, Path, description = "`lookdown`, or the name of a detector.")),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "Its inputs and outputs.", body = ModelMetadata),
    )
)]
pub(in crate::api) async fn model(
    State(state): State<ApiState>,
    _finder: Finder,
    Path(name): Path<String>,
) -> Result<Json<ModelMetadata>, Problem> {
    Ok(Json(Asked::find(&state, &name, None)?.metadata()))
}

/// What does this version of a model take and answer?
#[utoipa::path(
    get, path = "/v2/models/{name}/versions/{version}", tag = "inference",
    operation_id = "get_model_version",
    params(
        ("name" = String, Path, description = "`lookdown`, or the name of a detector."),
        ("version" = String, Path, description = "Its one version, as its metadata tells it."),
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "Its inputs and outputs.", body = ModelMetadata),
    )
)]
pub(in crate::api) async fn model_version(
    State(state): State<ApiState>,
    _finder: Finder,
    Path((name, version)): Path<(String, String)>,
) -> Result<Json<ModelMetadata>, Problem> {
    Ok(Json(Asked::find(&state, &name, Some(&version))?.metadata()))
}

/// Can a model be asked?
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
    _finder: Finder,
    Path(name): Path<String>,
) -> Result<Json<ModelReady>, Problem> {
    Asked::find(&state, &name, None)?;
    require_ready(&state)?;
    Ok(Json(ModelReady { name, ready: true }))
}

/// Can this version of a model be asked?
#[utoipa::path(
    get, path = "/v2/models/{name}/versions/{version}/ready", tag = "inference",
    operation_id = "get_model_version_readiness",
    params(
        ("name" = String, Path, description = "`lookdown`, or the name of a detector."),
        ("version" = String, Path, description = "Its one version, as its metadata tells it."),
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "It can.", body = ModelReady),
    )
)]
pub(in crate::api) async fn model_version_ready(
    State(state): State<ApiState>,
    _finder: Finder,
    Path((name, version)): Path<(String, String)>,
) -> Result<Json<ModelReady>, Problem> {
    Asked::find(&state, &name, Some(&version))?;
    require_ready(&state)?;
    Ok(Json(ModelReady { name, ready: true }))
}

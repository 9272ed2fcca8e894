//! Metadata and health checks of the server and its model.

use axum::{
    Json,
    extract::{Path, State},
};
use lookdown_detect::open_inference::metadata::{
    ModelMetadata, ModelReady, ServerLive, ServerMetadata, ServerReady,
};

use super::{
    own_metadata::{EXTENSIONS, FRAME_MODEL, NAME, require_frame_model},
    persons,
};
use crate::api::{ApiState, http::problem::Problem, require_scope::RequireDetect};

/// Get server metadata
#[utoipa::path(
    get, path = "/v2", tag = "operation", operation_id = "get_server_metadata",
    responses((status = OK, description = "The name, version, extensions and default of `follow` of the server.", body = ServerMetadata))
)]
pub(in crate::api) async fn server(State(state): State<ApiState>) -> Json<ServerMetadata> {
    Json(ServerMetadata {
        name: NAME.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        extensions: EXTENSIONS.map(ToOwned::to_owned).into(),
        follow: state.options.settings.detect.follow(),
    })
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
/// The only model, `lookdown`, accepts a frame and returns persons.
#[utoipa::path(
    get, path = "/v2/models/{name}", tag = "inference", operation_id = "get_model",
    params(("name" = String, Path, description = "`lookdown`.")),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "The inputs and outputs of the model.", body = ModelMetadata),
    )
)]
pub(in crate::api) async fn model(
    _scope: RequireDetect,
    Path(name): Path<String>,
) -> Result<Json<ModelMetadata>, Problem> {
    require_frame_model(&name)?;
    Ok(Json(persons::metadata()))
}

/// Check the readiness of a model
#[utoipa::path(
    get, path = "/v2/models/{name}/ready", tag = "inference", operation_id = "get_model_readiness",
    params(("name" = String, Path, description = "`lookdown`.")),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses(
        (status = OK, description = "It can.", body = ModelReady),
    )
)]
pub(in crate::api) async fn model_ready(
    State(state): State<ApiState>,
    _scope: RequireDetect,
    Path(name): Path<String>,
) -> Result<Json<ModelReady>, Problem> {
    require_frame_model(&name)?;
    state.require_ready()?;
    Ok(Json(ModelReady {
        name: FRAME_MODEL.to_owned(),
        ready: true,
    }))
}

//! The status routes of CodeProject.AI, which its clients call before they send frames.

use axum::Json;
use serde::Serialize;
use utoipa::ToSchema;

/// A server that responds.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct Pong {
    /// Always true.
    success: bool,
}

/// Newer versions of the server.
#[derive(Debug, Serialize, ToSchema)]
#[serde(rename_all = "camelCase")]
pub(in crate::api) struct VersionStatus {
    /// Always true.
    success: bool,
    /// An explanation.
    message: &'static str,
    /// Always false: the server looks for no updates.
    update_available: bool,
    /// The version that runs.
    version: &'static str,
}

/// Ping the server (CodeProject.AI)
#[utoipa::path(
    get, path = "/v1/status/ping", tag = "operation", operation_id = "ping_as_code_project_ai",
    security(()),
    responses((status = OK, description = "The server responds.", body = Pong))
)]
pub(in crate::api) async fn ping() -> Json<Pong> {
    Json(Pong { success: true })
}

/// Ping the server (CodeProject.AI 2)
#[utoipa::path(
    get, path = "/v1/server/status/ping", tag = "operation",
    operation_id = "ping_server_as_code_project_ai",
    security(()),
    responses((status = OK, description = "The server responds.", body = Pong))
)]
pub(in crate::api) async fn server_ping() -> Json<Pong> {
    ping().await
}

/// Get the version (CodeProject.AI)
///
/// Lookdown opens no connection to look for updates, so none is ever reported.
#[utoipa::path(
    get, path = "/v1/status/updateavailable", tag = "operation",
    operation_id = "get_update_as_code_project_ai",
    security(()),
    responses((status = OK, description = "The version that runs.", body = VersionStatus))
)]
pub(in crate::api) async fn update_available() -> Json<VersionStatus> {
    Json(VersionStatus {
        success: true,
        message: "Lookdown does not look for updates.",
        update_available: false,
        version: env!("CARGO_PKG_VERSION"),
    })
}

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
    version: VersionNumbers,
    /// The version that runs.
    current: VersionNumbers,
    /// The version that runs: no newer one is known.
    latest: VersionNumbers,
}

/// A version.
#[derive(Debug, Serialize, ToSchema)]
#[serde(rename_all = "camelCase")]
struct VersionNumbers {
    /// The first number.
    major: u32,
    /// The second number.
    minor: u32,
    /// The third number.
    patch: u32,
    /// The name of a version before a release; empty for a release.
    pre_release: &'static str,
    /// Always 0.
    build: u32,
    /// Always false.
    security_update: bool,
    /// Always empty.
    file: &'static str,
    /// Always empty.
    release_notes: &'static str,
}

impl VersionNumbers {
    /// The version that runs.
    fn current() -> Self {
        // Cargo writes numbers.
        let number = |text: &str| text.parse().unwrap_or_default();
        Self {
            major: number(env!("CARGO_PKG_VERSION_MAJOR")),
            minor: number(env!("CARGO_PKG_VERSION_MINOR")),
            patch: number(env!("CARGO_PKG_VERSION_PATCH")),
            pre_release: env!("CARGO_PKG_VERSION_PRE"),
            build: 0,
            security_update: false,
            file: "",
            release_notes: "",
        }
    }
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
        version: VersionNumbers::current(),
        current: VersionNumbers::current(),
        latest: VersionNumbers::current(),
    })
}

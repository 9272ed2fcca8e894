//! The deletion of a camera's reports.

use axum::{extract::State, http::StatusCode};

use super::{address::CameraAddress, unknown};
use crate::api::{ApiState, http::problem::Problem, require_scope::RequireAdmin, routes::counts};

/// Delete a camera's reports
///
/// Deletes all stored reports of a camera and its image. Home Assistant removes its entities, and
/// the counts keep the history only of a camera that this process does not read. The camera returns
/// with its next frame.
#[utoipa::path(
    delete, path = "/results/{camera}", tag = "results", operation_id = "delete_results",
    params(("camera" = String, Path, description = "The name of the camera.", example = "lobby")),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses((status = NO_CONTENT, description = "The reports are deleted."))
)]
pub(in crate::api) async fn delete(
    State(state): State<ApiState>,
    _admin: RequireAdmin,
    CameraAddress(camera): CameraAddress,
) -> Result<StatusCode, Problem> {
    state.options.views.forget(&camera);
    let had_reports = state.results.delete(&camera).await?;
    // The furniture that a user confirmed belongs to a camera until that is removed.
    let is_own = state.options.companions.own_cameras().contains(&camera);
    // The counts may know a camera that has had no frame since the start of the server.
    if is_own || counts::remove(&state, &camera).await || had_reports {
        tracing::info!(camera, "all reports of the camera were deleted");
        Ok(StatusCode::NO_CONTENT)
    } else {
        Err(unknown(&camera))
    }
}

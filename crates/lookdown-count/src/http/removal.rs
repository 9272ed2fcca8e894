//! The removal of a camera from the counts.

use axum::{
    extract::{Path, Query, State, rejection::QueryRejection},
    http::StatusCode,
};
use lookdown_http::problem::Problem;
use serde::Deserialize;
use utoipa::IntoParams;

use super::{
    counts::unusable_query,
    shared::{Shared, check_known, query},
};
use crate::sums::Owner;

/// The parameters of a removal.
#[derive(Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct RemovalParameters {
    /// `true` keeps the stored counts: the camera only leaves the list, the metrics and MQTT.
    #[serde(default)]
    keep_history: bool,
}

/// Delete the counts of a camera
///
/// Deletes its history, its tracks and its furniture. A camera that still sends frames begins
/// again with its next report.
#[utoipa::path(
    delete, path = "/counts/{camera}", tag = "counts", operation_id = "delete_camera_counts",
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    params(("camera" = String, Path, description = "The name of the camera."), RemovalParameters),
    responses((status = NO_CONTENT, description = "The counts are deleted."))
)]
pub(super) async fn delete(
    State(api): State<Shared>,
    Path(camera): Path<String>,
    parameters: Result<Query<RemovalParameters>, QueryRejection>,
) -> Result<StatusCode, Problem> {
    let Query(parameters) = parameters.map_err(|refused| unusable_query(&refused))?;
    let keeps = parameters.keep_history;
    let is_followed = api.counter.lock().remove(&camera, keeps);
    if !is_followed {
        check_known(&api, &Owner::Camera(camera.clone())).await?;
    }
    if !keeps {
        query(&api, move |store| store.remove(&camera)).await?;
    }
    Ok(StatusCode::NO_CONTENT)
}

//! The area that the walks of people suggest for a camera.

use axum::{
    Json,
    extract::{Path, State},
};
use lookdown_http::problem::Problem;
use lookdown_tracking::{LEAST_WALKED_M2, walked_area};
use serde::Serialize;
use utoipa::ToSchema;

use super::{
    heat_map::{Parameters, stored},
    shared::{Shared, blocking, not_found},
    time::TimeParameters,
};
use crate::sums::Owner;

/// A polygon for `areas` of the calibration.
#[derive(Serialize, ToSchema)]
struct SuggestedArea {
    /// The corners of the floor on which people walked and of 0.5 m around it, meters.
    floor_m: Vec<[f64; 2]>,
}

/// Suggest an area from walks
///
/// Covers whole days (UTC). `step` and `format` have no effect.
#[utoipa::path(
    get, path = "/counts/{camera}/suggested-area", tag = "counts", operation_id = "suggest_area",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("camera" = String, Path, description = "The name of the camera."), TimeParameters),
    responses((status = OK, description = "The floor on which people walked.", body = SuggestedArea))
)]
pub(super) async fn get(
    State(api): State<Shared>,
    Path(camera): Path<String>,
    parameters: Parameters,
) -> Result<Json<impl Serialize>, Problem> {
    let (_, cells) = stored(&api, Owner::Camera(camera), parameters).await?;
    let corners = blocking(move || Ok(walked_area(&cells))).await?;
    let floor_m = corners.ok_or_else(|| {
        not_found(format!(
            "no one has walked through {LEAST_WALKED_M2} m² of floor: wait until people have walked \
             where they can be, or give an earlier time as `from`"
        ))
    })?;
    Ok(Json(SuggestedArea { floor_m }))
}

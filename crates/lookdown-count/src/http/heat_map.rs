//! The heat map of the floor as JSON and PNG.

use std::collections::BTreeMap;

use axum::{
    Json,
    extract::{Path, Query, State, rejection::QueryRejection},
    response::Response,
};
use jiff::Timestamp;
use lookdown_http::problem::Problem;
use lookdown_tracking::heat_map::{CELL_M, Cell};
use serde::Serialize;
use utoipa::ToSchema;

use super::{
    counts::unusable_query,
    heat_map_image::draw,
    shared::{Shared, blocking, check_known, query},
    time::TimeParameters,
};
use crate::{
    now::time_of,
    sums::{DAY_MS, Owner},
    time_span::TimeSpan,
};

/// Most cells along a side of an answer: those with the most time decide.
const MAX_SIDE: i64 = 400;

/// Presence on the floor.
#[derive(Serialize, ToSchema)]
struct HeatMap {
    /// First and last day are whole days (UTC).
    from: Timestamp,
    to: Timestamp,
    cell_m: f64,
    /// The corner with the least x and y, meters on the floor of the camera or the site.
    origin_m: [f64; 2],
    /// Seconds of presence, row by row from the least y on.
    seconds: Vec<Vec<f64>>,
}

pub(super) type Parameters = Result<Query<TimeParameters>, QueryRejection>;

/// Get a camera's heat map
///
/// Covers whole days (UTC). `step` and `format` have no effect.
#[utoipa::path(
    get, path = "/counts/{camera}/heatmap.json", tag = "counts", operation_id = "get_camera_heat_map",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("camera" = String, Path, description = "The name of the camera."), TimeParameters),
    responses((status = OK, description = "Seconds of presence on the floor.", body = HeatMap))
)]
pub(super) async fn json_of_camera(
    State(api): State<Shared>,
    Path(camera): Path<String>,
    parameters: Parameters,
) -> Result<Json<impl Serialize>, Problem> {
    heat_map(&api, Owner::Camera(camera), parameters)
        .await
        .map(Json)
}

/// Get a site's heat map
///
/// Covers whole days (UTC). `step` and `format` have no effect.
#[utoipa::path(
    get, path = "/sites/{site}/heatmap.json", tag = "sites", operation_id = "get_site_heat_map",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("site" = String, Path, description = "The name of the site."), TimeParameters),
    responses((status = OK, description = "Seconds of presence on the floor.", body = HeatMap))
)]
pub(super) async fn json_of_site(
    State(api): State<Shared>,
    Path(site): Path<String>,
    parameters: Parameters,
) -> Result<Json<impl Serialize>, Problem> {
    heat_map(&api, Owner::Site(site), parameters)
        .await
        .map(Json)
}

/// Draw a camera's heat map
///
/// Covers whole days (UTC). `step` and `format` have no effect.
#[utoipa::path(
    get, path = "/counts/{camera}/heatmap.png", tag = "counts", operation_id = "draw_camera_heat_map",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("camera" = String, Path, description = "The name of the camera."), TimeParameters),
    responses((status = OK, description = "The heat map.", body = Vec<u8>, content_type = "image/png"))
)]
pub(super) async fn png_of_camera(
    State(api): State<Shared>,
    Path(camera): Path<String>,
    parameters: Parameters,
) -> Result<Response, Problem> {
    png(heat_map(&api, Owner::Camera(camera), parameters).await?).await
}

/// Draw a site's heat map
///
/// Covers whole days (UTC). `step` and `format` have no effect.
#[utoipa::path(
    get, path = "/sites/{site}/heatmap.png", tag = "sites", operation_id = "draw_site_heat_map",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("site" = String, Path, description = "The name of the site."), TimeParameters),
    responses((status = OK, description = "The heat map.", body = Vec<u8>, content_type = "image/png"))
)]
pub(super) async fn png_of_site(
    State(api): State<Shared>,
    Path(site): Path<String>,
    parameters: Parameters,
) -> Result<Response, Problem> {
    png(heat_map(&api, Owner::Site(site), parameters).await?).await
}

async fn heat_map(api: &Shared, owner: Owner, parameters: Parameters) -> Result<HeatMap, Problem> {
    let (time, cells) = stored(api, owner, parameters).await?;
    let day = |milliseconds: i64| time_of(milliseconds.div_euclid(DAY_MS) * DAY_MS);
    let (origin, seconds) = blocking(move || Ok(grid(&cells))).await?;
    Ok(HeatMap {
        from: day(time.from_ms),
        to: day(time.to_ms + DAY_MS - 1),
        cell_m: CELL_M,
        origin_m: origin.corner_m(),
        seconds,
    })
}

/// Returns the time of the parameters, and the milliseconds of presence per cell.
pub(super) async fn stored(
    api: &Shared,
    owner: Owner,
    parameters: Parameters,
) -> Result<(TimeSpan, BTreeMap<Cell, u64>), Problem> {
    let Query(parameters) = parameters.map_err(|refused| unusable_query(&refused))?;
    let time = parameters.span()?.time();
    check_known(api, &owner).await?;
    // A camera of a site shares the floor of the site.
    let owner = match &owner {
        Owner::Camera(camera) => {
            let counter = api.counter.lock();
            counter
                .scene_of(camera)
                .map_or(owner.clone(), |scene| scene.owner.clone())
        }
        Owner::Site(_) => owner,
    };
    let cells = query(api, move |store| store.cells(&owner, time)).await?;
    Ok((time, cells))
}

/// Returns the least cell and the seconds of all cells around the one with the most time.
fn grid(cells: &BTreeMap<Cell, u64>) -> (Cell, Vec<Vec<f64>>) {
    let hottest = cells.iter().max_by_key(|(_, milliseconds)| **milliseconds);
    let Some((hottest, _)) = hottest else {
        return (Cell { column: 0, row: 0 }, Vec::new());
    };
    let is_near = |cell: &&Cell| {
        let distance = |one: i16, other: i16| (i64::from(one) - i64::from(other)).abs();
        distance(cell.column, hottest.column) < MAX_SIDE / 2
            && distance(cell.row, hottest.row) < MAX_SIDE / 2
    };
    let near: Vec<Cell> = cells.keys().filter(is_near).copied().collect();
    let range = |index: fn(&Cell) -> i16| {
        let values = near.iter().map(index);
        let (least, most) = (values.clone().min(), values.max());
        (least.unwrap_or_default(), most.unwrap_or_default())
    };
    let (left, right) = range(|cell| cell.column);
    let (top, bottom) = range(|cell| cell.row);
    let rows = (top..=bottom).map(|row| {
        let columns = (left..=right).map(|column| {
            let milliseconds = cells.get(&Cell { column, row });
            milliseconds.map_or(0.0, |milliseconds| *milliseconds as f64 / 1000.0)
        });
        columns.collect()
    });
    (
        Cell {
            column: left,
            row: top,
        },
        rows.collect(),
    )
}

async fn png(map: HeatMap) -> Result<Response, Problem> {
    blocking(move || draw(&map.seconds)).await
}

//! The heat map of the floor as JSON and PNG, and over the frame of a camera.

use std::{collections::BTreeMap, sync::Arc};

use axum::{
    Json,
    extract::{Path, Query, State, rejection::QueryRejection},
    http::header::CONTENT_TYPE,
    response::{IntoResponse, Response},
};
use jiff::Timestamp;
use lookdown_http::problem::Problem;
use lookdown_lens::saturating::{to_u8, to_u32};
use lookdown_tracking::{
    LEAST_WALKED_M2,
    heat_map::{CELL_M, Cell},
    walked_area,
};
use serde::Serialize;
use utoipa::ToSchema;

use super::{
    shared::{Shared, blocking, check_known, not_found, query, unusable_query},
    time::TimeParameters,
};
use crate::{
    definition::CameraDefinition,
    now::time_of,
    sums::{DAY_MS, Owner, TimeSpan},
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

/// Pixels of a cell.
const CELL_PX: usize = 8;

/// Draws rows of seconds: transparent without presence, from blue to red with the logarithm of the
/// time.
fn draw(seconds: &[Vec<f64>]) -> Result<Response, Problem> {
    let columns = seconds.first().map_or(1, Vec::len);
    let rows = seconds.len().max(1);
    let most = seconds.iter().flatten().copied().fold(0.0, f64::max);
    let mut pixels = vec![0; columns * rows * CELL_PX * CELL_PX * 4];
    let width = columns * CELL_PX;
    for (row, cells) in seconds.iter().enumerate() {
        for (column, seconds) in cells.iter().enumerate() {
            let color = color(*seconds, most);
            for y in row * CELL_PX..(row + 1) * CELL_PX {
                let start = (y * width + column * CELL_PX) * 4;
                for pixel in pixels[start..start + CELL_PX * 4].chunks_exact_mut(4) {
                    pixel.copy_from_slice(&color);
                }
            }
        }
    }
    image(&pixels, width, rows * CELL_PX)
}

/// Returns pixels with red, green, blue and alpha as a PNG.
fn image(pixels: &[u8], width: usize, height: usize) -> Result<Response, Problem> {
    let file = encoded(pixels, width, height).map_err(|problem| {
        tracing::error!("the heat map cannot be encoded: {problem}");
        Problem::internal()
    })?;
    Ok(([(CONTENT_TYPE, "image/png")], file).into_response())
}

fn encoded(pixels: &[u8], width: usize, height: usize) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let side = |pixels: usize| u32::try_from(pixels).unwrap_or(u32::MAX);
    let mut encoder = png::Encoder::new(&mut file, side(width), side(height));
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(file)
}

/// Returns the color of a time of presence, with the most of any cell.
fn color(seconds: f64, most: f64) -> [u8; 4] {
    if seconds <= 0.0 {
        return [0; 4];
    }
    let share = (1.0 + seconds).ln() / (1.0 + most).ln();
    let channel = |value: f64| to_u8((value * 255.0).round());
    [
        channel(2.0 * share - 0.6),
        channel(1.2 - (2.4 * share - 1.2).abs()),
        channel(1.0 - 1.6 * share),
        channel(0.35 + 0.5 * share),
    ]
}

/// Width of the image, pixels. Its height follows from the frame.
const WIDTH: u32 = 480;

/// Draw a heat map over frames
///
/// Covers whole days (UTC). `step` and `format` have no effect.
#[utoipa::path(
    get, path = "/counts/{camera}/heatmap-frame.png", tag = "counts", operation_id = "draw_frame_heat_map",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("camera" = String, Path, description = "The name of the camera."), TimeParameters),
    responses((status = OK, description = "The heat map.", body = Vec<u8>, content_type = "image/png"))
)]
pub(super) async fn png_of_frame(
    State(api): State<Shared>,
    Path(camera): Path<String>,
    parameters: Parameters,
) -> Result<Response, Problem> {
    let (_, cells) = stored(&api, Owner::Camera(camera.clone()), parameters).await?;
    let definition = api.counter.lock().definition(&camera);
    let Some(definition) = definition.filter(|definition| definition.geometry.is_some()) else {
        let detail = "the camera has no calibration now: send frames with one";
        return Err(not_found(detail));
    };
    blocking(move || {
        let (pixels, height) = drawn(&cells, &definition);
        image(&pixels, WIDTH as usize, height as usize)
    })
    .await
}

/// Draws the map, transparent without presence. Returns the pixels and the height.
fn drawn(cells: &BTreeMap<Cell, u64>, definition: &Arc<CameraDefinition>) -> (Vec<u8>, u32) {
    let key = &definition.key;
    let scale = f64::from(key.width) / f64::from(WIDTH);
    let height = to_u32((f64::from(key.height) / scale).round()).clamp(1, 16 * WIDTH);
    let seconds = |milliseconds: u64| milliseconds as f64 / 1000.0;
    let most = cells.values().copied().max().map_or(0.0, seconds);
    let mut pixels = Vec::with_capacity(WIDTH as usize * height as usize * 4);
    for y in 0..height {
        for x in 0..WIDTH {
            let middle = [x, y].map(|pixel| (f64::from(pixel) + 0.5) * scale);
            let cell = definition.floor_at(middle).and_then(Cell::at);
            let time = cell.and_then(|cell| cells.get(&cell));
            pixels.extend(color(time.copied().map_or(0.0, seconds), most));
        }
    }
    (pixels, height)
}

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
pub(super) async fn suggest_area(
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

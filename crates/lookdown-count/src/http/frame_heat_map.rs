//! The heat map over the frame of a camera.

use std::{collections::BTreeMap, sync::Arc};

use axum::{
    extract::{Path, State},
    response::Response,
};
use lookdown_http::problem::Problem;
use lookdown_lens::saturating::to_u32;
use lookdown_tracking::heat_map::Cell;

use super::{
    heat_map::{Parameters, stored},
    heat_map_image::{color, image},
    shared::{Shared, blocking, not_found},
    time::TimeParameters,
};
use crate::{definition::CameraDefinition, sums::Owner};

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
pub(super) async fn png(
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

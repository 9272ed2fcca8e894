//! The preview of a fit: straightened views of the room with an assumed lens and with the found
//! one, and the frame with the edges that follow the room.

mod wall_views;

use std::f64::consts::FRAC_PI_2;

use anyhow::Context;
use lookdown_calibration::Calibration;
use lookdown_imaging::{
    Frame,
    annotate::{Caption, ROOM_LEGEND, encode_jpeg, sketch_room},
    lens_circle, narrowed,
    room_fit::RoomFrame,
};
use lookdown_lens::{
    geometry::{Lens, Mount},
    self_calibration::RoomFit,
};

use self::wall_views::{WIDTH, wall_views};

/// Height of a line of text, pixels.
const TEXT_HEIGHT: f64 = 28.0;
/// Distance of captions from the left and the upper edge of their row, pixels.
const MARGIN: f64 = 12.0;
const CAPTION_COLOR: [u8; 3] = [255; 3];
const JPEG_QUALITY: u8 = 90;

/// A row of the preview.
struct Row {
    /// At most as wide as the preview.
    image: Frame,
    /// Lines of text with their colors.
    caption: &'static [(&'static str, [u8; 3])],
}

/// Draws three rows: views toward the four walls with an equidistant lens of 180° that looks
/// straight down, the same views with the fitted camera, and the frame with the edges that follow
/// the room, the horizon, and the point straight below the camera.
pub(crate) fn draw(
    calibration: &Calibration,
    fit: &RoomFit,
    frame: &Frame,
    edges: &RoomFrame,
) -> anyhow::Result<Vec<u8>> {
    let circle = lens_circle::find_lens_circle(frame)
        .unwrap_or_else(|| lens_circle::assumed_circle(frame.width(), frame.height()));
    let assumed = Lens::equidistant_circle(circle.cx, circle.cy, circle.radius, FRAC_PI_2)
        .context("--preview: the lens circle has no lens")?;
    let (lens, mount) = (calibration.lens(), calibration.mount());
    let wall = &fit.directions[1];
    let mut room = frame.clone();
    sketch_room(&mut room, &edges.edges_along(fit), lens, mount);
    let rows = [
        Row {
            image: wall_views(frame, &assumed, &Mount::default(), wall)?,
            caption: &[("assumed lens", CAPTION_COLOR)],
        },
        Row {
            image: wall_views(frame, lens, mount, wall)?,
            caption: &[("found lens", CAPTION_COLOR)],
        },
        Row {
            image: narrowed(&room, WIDTH),
            caption: &ROOM_LEGEND,
        },
    ];
    Ok(encode_jpeg(&stacked(&rows)?, JPEG_QUALITY)?)
}

/// Stacks rows: each image in the middle, and the caption in the corner.
fn stacked(rows: &[Row]) -> anyhow::Result<Frame> {
    let height = rows.iter().map(|row| row.image.height()).sum();
    let mut pixels = Vec::with_capacity(3 * WIDTH as usize * height as usize);
    for Row { image, .. } in rows {
        let width = 3 * image.width() as usize;
        let left = 3 * ((WIDTH - image.width()) / 2) as usize;
        for row in image.pixels().chunks_exact(width) {
            let start = pixels.len();
            pixels.resize(start + left, 0);
            pixels.extend_from_slice(row);
            pixels.resize(start + 3 * WIDTH as usize, 0);
        }
    }
    let mut stacked = Frame::new(WIDTH, height, pixels)?;
    let mut top = 0;
    for Row { image, caption } in rows {
        let caption = Caption {
            lines: caption,
            corner: [MARGIN, f64::from(top) + MARGIN],
            text_height: TEXT_HEIGHT,
        };
        caption.draw(&mut stacked);
        top += image.height();
    }
    Ok(stacked)
}

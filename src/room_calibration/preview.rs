//! The preview of a fit: straightened views of the room with an assumed lens and with the found
//! one, and the frame with the edges that follow the room.

use std::f64::consts::FRAC_PI_2;

use anyhow::Context;
use lookdown_calibration::Calibration;
use lookdown_imaging::{
    Frame, FrameError,
    annotate::{Caption, ROOM_LEGEND, encode_jpeg, sketch_room},
    lens_circle, narrowed,
    room_fit::RoomFrame,
};
use lookdown_lens::{
    geometry::{Lens, Mount, Pixel, Ray, VirtualView},
    saturating::to_u32,
    self_calibration::RoomFit,
};

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

/// Side of a view in pixels.
const SIDE: u32 = 480;
/// Width of the four views, pixels.
const WIDTH: u32 = 4 * SIDE;
/// Focal length of a view in pixels: 90° across.
const FOCAL: f64 = 240.0;
/// Angle of the axes of the views from the nadir, degrees.
const OFF_NADIR: f64 = 50.0;

/// Renders views along a horizontal direction of the room, which may be off by the tilt of the
/// mount, and across it. They are lowered toward the nadir.
fn wall_views(
    frame: &Frame,
    lens: &Lens,
    mount: &Mount,
    direction: &Ray,
) -> Result<Frame, FrameError> {
    let nadir = mount.nadir();
    let wall = (direction - nadir * nadir.dot(direction)).normalize();
    let (sin, cos) = OFF_NADIR.to_radians().sin_cos();
    let mut pixels = vec![0; 3 * WIDTH as usize * SIDE as usize];
    let walls = [wall, nadir.cross(&wall), -wall, -nadir.cross(&wall)];
    for (column, wall) in (0_u32..).zip(walls) {
        let axis = nadir * cos + wall * sin;
        let view = VirtualView::looking_along(&axis, FOCAL, mount, SIDE, SIDE);
        for y in 0..SIDE {
            for x in 0..SIDE {
                let ray = view.ray_in_camera(&Pixel::new(f64::from(x), f64::from(y)));
                let color = lens.project(&ray).and_then(|at| nearest(frame, &at));
                let start = 3 * (y as usize * WIDTH as usize + (column * SIDE + x) as usize);
                pixels[start..start + 3].copy_from_slice(&color.unwrap_or_default());
            }
        }
    }
    Frame::new(WIDTH, SIDE, pixels)
}

/// The pixel at a position, or `None` outside the frame.
fn nearest(frame: &Frame, at: &Pixel) -> Option<[u8; 3]> {
    let (x, y) = (at.x.round(), at.y.round());
    let is_inside =
        x >= 0.0 && y >= 0.0 && x < f64::from(frame.width()) && y < f64::from(frame.height());
    is_inside.then(|| frame.pixel(to_u32(x), to_u32(y)))
}

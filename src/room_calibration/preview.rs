//! Straightened views of the room before and after the fit.

use std::f64::consts::FRAC_PI_2;

use anyhow::Context;
use lookdown_detect::imaging::{Frame, annotate::encode_jpeg, lens_circle};
use lookdown_lens::{
    calibration::Calibration,
    geometry::{Lens, Mount, Pixel, VirtualView},
    self_calibration::RoomFit,
};

/// Side of a view in pixels.
const SIDE: u32 = 480;
/// Focal length of a view: 90° across.
const FOCAL: f64 = 240.0;
/// Angle of the axes of the views from the nadir, degrees.
const OFF_NADIR: f64 = 50.0;
const JPEG_QUALITY: u8 = 90;

/// Draws views toward the four walls: above with an equidistant lens of 180° that looks straight
/// down, below with the fitted camera.
pub(crate) fn draw(
    calibration: &Calibration,
    fit: &RoomFit,
    frame: &Frame,
) -> anyhow::Result<Vec<u8>> {
    let circle = lens_circle::find_lens_circle(frame)
        .unwrap_or_else(|| lens_circle::assumed_circle(frame.width(), frame.height()));
    let before = Lens::equidistant_circle(circle.cx, circle.cy, circle.radius, FRAC_PI_2)
        .context("--preview: the lens circle has no lens")?;
    let default = Mount::default();
    let rows = [
        (&before, &default),
        (calibration.lens(), calibration.mount()),
    ];
    let (width, height) = (4 * SIDE, 2 * SIDE);
    let mut pixels = vec![0; 3 * width as usize * height as usize];
    for (row, (lens, mount)) in (0_u32..).zip(rows) {
        for column in 0..4_u32 {
            // Along a horizontal direction of the room, lowered toward the nadir.
            let (sin, cos) = OFF_NADIR.to_radians().sin_cos();
            let nadir = mount.nadir();
            let wall = (fit.directions[1] - nadir * nadir.dot(&fit.directions[1])).normalize();
            let wall = [wall, nadir.cross(&wall), -wall, -nadir.cross(&wall)][column as usize];
            let axis = nadir * cos + wall * sin;
            let view = VirtualView::looking_along(&axis, FOCAL, mount, SIDE, SIDE);
            for y in 0..SIDE {
                for x in 0..SIDE {
                    let ray = view.ray_in_camera(&Pixel::new(f64::from(x), f64::from(y)));
                    let color = lens.project(&ray).and_then(|at| nearest(frame, &at));
                    let (left, top) = (column * SIDE + x, row * SIDE + y);
                    let start = 3 * (top as usize * width as usize + left as usize);
                    pixels[start..start + 3].copy_from_slice(&color.unwrap_or_default());
                }
            }
        }
    }
    Ok(encode_jpeg(
        &Frame::new(width, height, pixels)?,
        JPEG_QUALITY,
    )?)
}

/// The pixel at a position, or `None` outside the frame.
fn nearest(frame: &Frame, at: &Pixel) -> Option<[u8; 3]> {
    let (x, y) = (at.x.round(), at.y.round());
    let is_inside =
        x >= 0.0 && y >= 0.0 && x < f64::from(frame.width()) && y < f64::from(frame.height());
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "inside the frame"
    )]
    is_inside.then(|| frame.pixel(x as u32, y as u32))
}

//! Straightened views toward the four walls of a room, side by side.

use lookdown_imaging::{Frame, FrameError};
use lookdown_lens::geometry::{Lens, Mount, Pixel, Ray, VirtualView};

/// Side of a view in pixels.
const SIDE: u32 = 480;
/// Width of the four views, pixels.
pub(super) const WIDTH: u32 = 4 * SIDE;
/// Focal length of a view in pixels: 90° across.
const FOCAL: f64 = 240.0;
/// Angle of the axes of the views from the nadir, degrees.
const OFF_NADIR: f64 = 50.0;

/// Renders views along a horizontal direction of the room, which may be off by the tilt of the
/// mount, and across it. They are lowered toward the nadir.
pub(super) fn wall_views(
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
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "inside the frame"
    )]
    is_inside.then(|| frame.pixel(x as u32, y as u32))
}

//! Boxes of people for tests.

use super::{Lens, OrientedBox, Pixel, Ray, pixels::to_corner_origin};

/// Returns the box of a person of `height_m` who stands `out_m` away in the direction `azimuth`
/// from the point below a camera at `camera_m` that looks straight down.
pub(crate) fn standing(
    lens: &Lens,
    camera_m: f64,
    [out_m, azimuth]: [f64; 2],
    height_m: f64,
) -> OrientedBox {
    let (sin, cos) = azimuth.sin_cos();
    let ends = [0.0, height_m].map(|up_m| -> Pixel {
        let ray = Ray::new(out_m * cos, out_m * sin, camera_m - up_m);
        to_corner_origin(lens.project(&ray).unwrap())
    });
    OrientedBox::averaging((ends[1] - ends[0]).normalize(), [(1.0, &ends[..])]).unwrap()
}

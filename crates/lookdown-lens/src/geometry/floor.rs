//! Bearings and floor positions of pixels.

use super::{
    Lens, Mount, Pixel, Ray,
    pixels::{to_corner_origin, to_pixel_center},
};

/// Rays flatter than this above the floor (cosine of the angle from straight down) hit it too far
/// away for the height to mean anything: 88°, about 29 heights away.
const MIN_DOWNWARD_COSINE: f64 = 0.035;

/// The direction of a pixel as seen from the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bearing {
    /// 0 toward image right, growing clockwise on the screen, radians in [0, 2π).
    pub azimuth: f64,
    /// Angle from the optical axis, radians.
    pub off_axis: f64,
}

/// A place on the floor; origin below the camera, x toward image right and y toward image down of
/// a camera that looks straight down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FloorPosition {
    /// Meters toward image right.
    pub x_m: f64,
    /// Meters toward image down.
    pub y_m: f64,
}

/// The bearing of `point` (corner-origin frame pixels); `None` outside the lens image.
pub fn bearing(point: Pixel, lens: &Lens) -> Option<Bearing> {
    let ray = lens.unproject(&to_pixel_center(point))?;
    Some(Bearing {
        azimuth: ray.y.atan2(ray.x).rem_euclid(std::f64::consts::TAU),
        off_axis: ray.x.hypot(ray.y).atan2(ray.z),
    })
}

/// Returns the place at which the ray through `point` (corner-origin frame pixels) meets the floor;
/// `None` when the height is unknown, the point lies outside the lens image, or the ray does not
/// fall.
pub fn floor_position(point: Pixel, lens: &Lens, mount: &Mount) -> Option<FloorPosition> {
    let height_m = mount.height_m()?;
    let ray = lens.unproject(&to_pixel_center(point))?;
    let levelled = mount.camera_from_floor().inverse_transform_vector(&ray);
    (levelled.z >= MIN_DOWNWARD_COSINE).then(|| FloorPosition {
        x_m: height_m * levelled.x / levelled.z,
        y_m: height_m * levelled.y / levelled.z,
    })
}

/// Returns the pixel at which the lens shows a place on the floor, corner-origin frame pixels;
/// `None` when the height is unknown or the lens does not see it.
pub fn pixel_of(place: FloorPosition, lens: &Lens, mount: &Mount) -> Option<Pixel> {
    let levelled = Ray::new(place.x_m, place.y_m, mount.height_m()?);
    let pixel = lens.project(&(mount.camera_from_floor() * levelled))?;
    Some(to_corner_origin(pixel))
}

#[cfg(test)]
mod tests;

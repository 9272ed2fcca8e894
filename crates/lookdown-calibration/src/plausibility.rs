//! The check that a lens and a frame belong together: most wrong calibrations are right ones for
//! another frame size.

use std::f64::consts::FRAC_PI_2;

use lookdown_lens::geometry::{Lens, Pixel, Ray};

/// Pixels may be this much wider than high, or higher than wide: half-resolution video is.
const MAX_PIXEL_ASPECT: f64 = 2.5;
/// The lens image is at least this large, in units of the frame's shorter side.
const MIN_RIM_RADIUS: f64 = 0.125;
/// A frame whose corners are less off the axis than this was not made by a wide-angle lens,
/// radians.
const MIN_CORNER_THETA: f64 = 0.2;
/// A frame shows at least this share of the half space that its lens claims to see.
const MIN_CORNER_SHARE: f64 = 1.0 / 3.0;
/// An angle near the axis, where every lens is affine, radians.
const NEAR_AXIS: f64 = 1e-4;

/// Checks `lens` for frames of `width` × `height` pixels, of whose image the farthest
/// point is `corner_theta` radians off the axis.
pub(super) fn check(lens: &Lens, width: u32, height: u32, corner_theta: f64) -> Result<(), String> {
    let center = lens.principal_point();
    let (frame_width, frame_height) = (f64::from(width), f64::from(height));
    let is_inside = (-0.5..=frame_width - 0.5).contains(&center.x)
        && (-0.5..=frame_height - 0.5).contains(&center.y);
    if !is_inside {
        return Err(format!(
            "its center, cx {} and cy {}, lies outside the frame of {width}×{height} pixels: give \
             both in pixels of that frame",
            center.x, center.y
        ));
    }
    let near_axis = |x, y| distance(lens, center, &Ray::new(x, y, 1.0));
    let aspect = near_axis(NEAR_AXIS, 0.0) / near_axis(0.0, NEAR_AXIS);
    if !(1.0 / MAX_PIXEL_ASPECT..=MAX_PIXEL_ASPECT).contains(&aspect) {
        return Err(format!(
            "an angle is {aspect:.3} times as long across the frame as down it: the horizontal and \
             the vertical focal length (fx and fy, aspect, or c) belong to different images"
        ));
    }
    let rim = Ray::new(lens.max_theta().sin(), 0.0, lens.max_theta().cos());
    let rim_radius = distance(lens, center, &rim);
    if rim_radius < MIN_RIM_RADIUS * frame_width.min(frame_height) {
        return Err(format!(
            "its image ends {rim_radius:.0} pixels from the center, a speck in a frame of \
             {width}×{height}: give the focal length and the image size of the same image"
        ));
    }
    let expected = MIN_CORNER_THETA.max(MIN_CORNER_SHARE * lens.max_theta().min(FRAC_PI_2));
    if corner_theta < expected.min(lens.max_theta()) {
        return Err(format!(
            "the corners of a frame of {width}×{height} pixels are only {:.1}° off its axis: give \
             the focal length and the image size of the same image",
            corner_theta.to_degrees()
        ));
    }
    Ok(())
}

/// Returns the distance from the center at which the lens shows `ray`, pixels; infinite where it
/// does not show it.
fn distance(lens: &Lens, center: Pixel, ray: &Ray) -> f64 {
    lens.project_to_rim(ray)
        .map_or(f64::INFINITY, |pixel| (pixel - center).norm())
}

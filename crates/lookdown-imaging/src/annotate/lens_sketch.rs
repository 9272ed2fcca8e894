//! A lens drawn into its frame: the edge of the lens image, rings of equal angle, radial lines and
//! the outlines of virtual views.

use std::f64::consts::{FRAC_PI_2, TAU};

use lookdown_lens::geometry::{
    Lens, Pixel, Ray, VirtualView,
    pixels::{PixelConvention, cross_half_pixel},
};

use super::{
    canvas::{Rgb, Stroke},
    line_width,
};
use crate::Frame;

const RIM: Rgb = [255, 90, 80];
const RING: Rgb = [255, 220, 60];
const RIGHT_ANGLE: Rgb = [255, 160, 40];
const VIEW: Rgb = [0, 214, 255];
/// Angle between two rings, radians.
const RING_STEP: f64 = TAU / 24.0;
/// Radial lines in a full turn.
const RADIAL_LINES: u32 = 12;
/// Points on a circle and along each side of a view.
pub(super) const CIRCLE_POINTS: u32 = 180;
const SIDE_POINTS: u32 = 32;

/// Draws thin outlines of `views`, a ring every 15° off the axis, a line every 30° around the axis,
/// and the rim of the lens image.
pub fn sketch_lens(frame: &mut Frame, lens: &Lens, views: &[VirtualView]) {
    let thin = line_width(frame) * 0.5;
    for view in views {
        draw(
            frame,
            view.border_rays(SIDE_POINTS).map(|ray| lens.project(&ray)),
            VIEW,
            thin,
        );
    }
    for line in 0..RADIAL_LINES {
        let azimuth = TAU * f64::from(line) / f64::from(RADIAL_LINES);
        let points = (1..=CIRCLE_POINTS).map(|step| {
            let theta = lens.max_theta() * f64::from(step) / f64::from(CIRCLE_POINTS);
            lens.project(&ray(theta, azimuth))
        });
        draw(frame, points, RING, thin);
    }
    let rings = (1_u32..).map(|ring| RING_STEP * f64::from(ring));
    for theta in rings.take_while(|&theta| theta < lens.max_theta()) {
        let is_right_angle = (theta - FRAC_PI_2).abs() < 1e-9;
        let (color, width) = if is_right_angle {
            (RIGHT_ANGLE, 2.0 * thin)
        } else {
            (RING, thin)
        };
        draw(
            frame,
            circle(theta).map(|ray| lens.project(&ray)),
            color,
            width,
        );
    }
    let rim = circle(lens.max_theta()).map(|ray| lens.project_to_rim(&ray));
    draw(frame, rim, RIM, 3.0 * thin);
}

fn ray(theta: f64, azimuth: f64) -> Ray {
    Ray::new(
        theta.sin() * azimuth.cos(),
        theta.sin() * azimuth.sin(),
        theta.cos(),
    )
}

/// Rays of equal angle from the axis. The first one is repeated at the end.
fn circle(theta: f64) -> impl Iterator<Item = Ray> {
    (0..=CIRCLE_POINTS)
        .map(move |step| ray(theta, TAU * f64::from(step) / f64::from(CIRCLE_POINTS)))
}

/// Draws a line through points (pixel centers), interrupted where a point is outside the lens
/// image.
pub(super) fn draw(
    frame: &mut Frame,
    points: impl Iterator<Item = Option<Pixel>>,
    color: Rgb,
    width: f64,
) {
    let mut previous = None;
    for point in points {
        let point = point.map(|point| {
            let corner_origin = cross_half_pixel(point, PixelConvention::CornerOrigin);
            [corner_origin.x, corner_origin.y]
        });
        if let (Some(from), Some(to)) = (previous, point) {
            Stroke::new(from, to, width).draw(frame, color, 1.0);
        }
        previous = point;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> Frame {
        Frame::new(200, 200, vec![0; 3 * 200 * 200]).expect("the pixels fit the size")
    }

    fn color_at(frame: &Frame, x: usize, y: usize) -> [u8; 3] {
        let start = 3 * (y * 200 + x);
        [0, 1, 2].map(|channel| frame.pixels()[start + channel])
    }

    #[test]
    fn the_rim_is_drawn_where_the_lens_image_ends() {
        let lens = Lens::equidistant_circle(99.5, 99.5, 80.0, 1.5).expect("a plausible lens");
        let mut frame = frame();
        sketch_lens(&mut frame, &lens, &[]);
        // Corner-origin (180, 100) lies at pixel center (179.5, 99.5).
        let [red, ..] = color_at(&frame, 179, 103);
        assert!(red > 100, "{:?}", color_at(&frame, 179, 103));
        assert_eq!(color_at(&frame, 190, 60), [0, 0, 0]);
    }

    #[test]
    fn a_lens_far_larger_than_its_frame_is_drawn_in_bounded_time() {
        let lens = Lens::equidistant_circle(1e9, -1e9, 1e12, 1.5).expect("a plausible lens");
        sketch_lens(&mut frame(), &lens, &[]);
    }
}

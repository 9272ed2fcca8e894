//! The room of a fitted camera drawn into its frame: the edges along its directions, the horizon,
//! and the point straight below the camera.
//!
//! A lens drawn into its frame: the edge of the lens image, rings of equal angle, radial lines and
//! the outlines of virtual views.

use std::f64::consts::{FRAC_PI_2, TAU};

use lookdown_lens::{
    geometry::{Lens, Mount, Pixel, Ray, VirtualView, pixels::to_corner_origin},
    self_calibration::EdgeCurve,
};

use super::{
    SHADOW, SHADOW_OPACITY,
    canvas::{Plate, Rgb, Stroke},
    line_width,
};
use crate::Frame;

/// Colors of the edges along the vertical, and along the two horizontal directions.
const EDGES: [Rgb; 3] = [[0, 214, 255], [255, 200, 30], [255, 80, 200]];
const HORIZON: Rgb = [126, 240, 110];
const NADIR: Rgb = [255, 255, 255];

/// Names of the parts of the drawing, each with its color.
pub const ROOM_LEGEND: [(&str, [u8; 3]); 5] = [
    ("edges along the vertical", EDGES[0]),
    ("along two walls", EDGES[1]),
    ("along the walls across", EDGES[2]),
    ("horizon", HORIZON),
    ("straight below", NADIR),
];

/// Draws edges by their direction: the vertical and the two horizontal ones. Draws the horizon
/// where the lens sees it, and the point straight below the camera. Edges are in pixel centers.
pub fn sketch_room(frame: &mut Frame, edges: &[Vec<&EdgeCurve>; 3], lens: &Lens, mount: &Mount) {
    let width = line_width(frame);
    for (edges, color) in edges.iter().zip(EDGES) {
        for edge in edges {
            let points = edge.points.iter().map(|[x, y]| Some(Pixel::new(*x, *y)));
            draw_curve(frame, points, color, width);
        }
    }
    let horizon = horizon(mount).map(|ray| lens.project(&ray));
    draw_curve(frame, horizon, HORIZON, 1.5 * width);
    if let Some(nadir) = lens.project(&mount.nadir()) {
        let center = to_corner_origin(nadir);
        disk(center, 4.0 * width).draw(frame, SHADOW, SHADOW_OPACITY);
        disk(center, 2.5 * width).draw(frame, NADIR, 1.0);
    }
}

/// Rays at the height of the camera, once around. The first one is repeated at the end.
fn horizon(mount: &Mount) -> impl Iterator<Item = Ray> {
    let camera_from_floor = mount.camera_from_floor();
    (0..=CIRCLE_POINTS).map(move |step| {
        let (sin, cos) = (TAU * f64::from(step) / f64::from(CIRCLE_POINTS)).sin_cos();
        camera_from_floor * Ray::new(cos, sin, 0.0)
    })
}

/// A filled circle of a radius in pixels.
fn disk(center: Pixel, radius: f64) -> Plate {
    Plate {
        left: center.x - radius,
        top: center.y - radius,
        width: 2.0 * radius,
        height: 2.0 * radius,
        radius,
    }
}

const RIM: Rgb = [255, 90, 80];
const RING: Rgb = [255, 220, 60];
const RIGHT_ANGLE: Rgb = [255, 160, 40];
const VIEW: Rgb = [0, 214, 255];
/// Angle between two rings, radians.
const RING_STEP: f64 = TAU / 24.0;
/// Radial lines in a full turn.
const RADIAL_LINES: u32 = 12;
/// Points on a circle and along each side of a view.
const CIRCLE_POINTS: u32 = 180;
const SIDE_POINTS: u32 = 32;

/// Draws thin outlines of `views`, a ring every 15° off the axis, a line every 30° around the axis,
/// and the rim of the lens image.
pub fn sketch_lens(frame: &mut Frame, lens: &Lens, views: &[VirtualView]) {
    let thin = line_width(frame) * 0.5;
    for view in views {
        draw_curve(
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
        draw_curve(frame, points, RING, thin);
    }
    let rings = (1_u32..).map(|ring| RING_STEP * f64::from(ring));
    for theta in rings.take_while(|&theta| theta < lens.max_theta()) {
        let is_right_angle = (theta - FRAC_PI_2).abs() < 1e-9;
        let (color, width) = if is_right_angle {
            (RIGHT_ANGLE, 2.0 * thin)
        } else {
            (RING, thin)
        };
        draw_curve(
            frame,
            circle(theta).map(|ray| lens.project(&ray)),
            color,
            width,
        );
    }
    let rim = circle(lens.max_theta()).map(|ray| lens.project_to_rim(&ray));
    draw_curve(frame, rim, RIM, 3.0 * thin);
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
fn draw_curve(
    frame: &mut Frame,
    points: impl Iterator<Item = Option<Pixel>>,
    color: Rgb,
    width: f64,
) {
    let mut previous = None;
    for point in points {
        let point = point.map(|point| {
            let corner_origin = to_corner_origin(point);
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
    use nalgebra::Unit;

    use super::*;

    #[test]
    fn edges_horizon_and_nadir_are_drawn_at_their_places() {
        let mut frame = Frame::new(200, 200, vec![90; 3 * 200 * 200]).unwrap();
        let lens = Lens::equidistant_circle(99.5, 99.5, 90.0, 1.6).unwrap();
        // The camera looks 0.4 radians to the right of straight down.
        let mount = Mount::new(
            Unit::new_normalize(Ray::new(0.4_f64.sin(), 0.0, -0.4_f64.cos())),
            None,
        );
        let edge = |y: f64| EdgeCurve {
            points: vec![[60.0, y], [100.0, y], [140.0, y]],
            scale: 1.0,
        };
        let edges = [60.0, 80.0, 120.0].map(edge);
        sketch_room(
            &mut frame,
            &edges.each_ref().map(|edge| vec![edge]),
            &lens,
            &mount,
        );
        for (y, color) in [60, 80, 120].into_iter().zip(EDGES) {
            assert_eq!(frame.pixel(90, y), color);
        }
        let column = |theta: f64| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "in the frame"
            )]
            let column = (100.0 + 90.0 * theta / 1.6).round() as u32;
            column
        };
        let is_horizon = |x: u32| frame.pixel(x, 99)[1] > 150 && frame.pixel(x, 99)[0] < 130;
        let right = column(std::f64::consts::FRAC_PI_2 - 0.4);
        assert!((right - 1..=right).any(is_horizon), "{right}");
        // On the left, the horizon is beyond the lens image.
        assert!(!(0..60).any(is_horizon));
        assert_eq!(frame.pixel(column(-0.4), 99), NADIR);
    }

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

//! The room of a fitted camera drawn into its frame: the edges along its directions, the horizon,
//! and the point straight below the camera.

use std::f64::consts::TAU;

use lookdown_lens::{
    geometry::{
        Lens, Mount, Pixel, Ray,
        pixels::{PixelConvention, cross_half_pixel},
    },
    self_calibration::EdgeCurve,
};

use super::{
    SHADOW, SHADOW_OPACITY,
    canvas::{Plate, Rgb},
    lens_sketch::{self, CIRCLE_POINTS},
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
            lens_sketch::draw(frame, points, color, width);
        }
    }
    let horizon = horizon(mount).map(|ray| lens.project(&ray));
    lens_sketch::draw(frame, horizon, HORIZON, 1.5 * width);
    if let Some(nadir) = lens.project(&mount.nadir()) {
        let center = cross_half_pixel(nadir, PixelConvention::CornerOrigin);
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
}

//! The camera of a sequence: boxes as the product sees them.

use anyhow::Result;
use lookdown_lens::{
    geometry::{
        Lens, Mount, OrientedBox, Pixel, PostureSigns,
        floor::{bearing, floor_position},
        oriented_box::vertical_in_frame,
    },
    self_calibration::CameraHeight,
};
use lookdown_tracking::Observation;
use nalgebra::{Unit, Vector3};

use crate::data::{Circle, Frame, Rectangle};

/// The lens goes on this far beyond the circle, as people at the rim reach beyond it.
const BEYOND: f64 = 1.1;
/// Least score of the people who give the height of the camera, and most frames of them.
const CLEAR_SCORE: f64 = 0.3;
const FRAMES_FOR_HEIGHT: usize = 300;
/// Height where people give none, meters.
const HEIGHT_M: f64 = 3.0;

/// A camera that looks straight down.
pub struct View {
    lens: Lens,
    mount: Mount,
    pub height_m: f64,
}

impl View {
    /// Returns the view, with the height that the people give.
    pub fn new<'a>(
        circle: &Circle,
        frames: impl Iterator<Item = &'a Frame> + Clone,
    ) -> Result<Self> {
        let [x, y] = circle.center;
        let edge = BEYOND * std::f64::consts::FRAC_PI_2;
        let up = Unit::new_normalize(-Vector3::z());
        let mut view = Self {
            lens: Lens::equidistant_circle(x, y, circle.radius * BEYOND, edge)?,
            mount: Mount::new(up, None),
            height_m: HEIGHT_M,
        };
        let step = (frames.clone().count() / FRAMES_FOR_HEIGHT).max(1);
        let found = frames.step_by(step).flat_map(|frame| &frame.found);
        let clear = found.filter(|(_, score)| *score >= CLEAR_SCORE);
        let people: Vec<OrientedBox> = clear
            .map(|(rectangle, _)| view.nearer_axis(rectangle))
            .collect();
        if let Ok(found) = CameraHeight::from_people(&people, &view.lens, &view.mount) {
            view.height_m = found.height_m;
        }
        view.mount = Mount::new(up, Some(view.height_m));
        Ok(view)
    }

    /// The box with the one of its two axes as height that is nearer to the vertical.
    fn nearer_axis(&self, [x, y, width, height, angle]: &Rectangle) -> OrientedBox {
        let center = Pixel::new(*x, *y);
        let vertical = vertical_in_frame(center, &self.lens, &self.mount);
        let one = OrientedBox::turned(center, *width, *height, angle.to_radians());
        let other = OrientedBox::turned(center, *height, *width, (angle + 90.0).to_radians());
        let is_one = one.up.dot(&vertical).abs() >= other.up.dot(&vertical).abs();
        if is_one { one } else { other }.with_head_toward(&vertical)
    }

    /// The box turned to the vertical, with the extents of its inscribed ellipse there.
    fn upright(&self, rectangle: &Rectangle) -> OrientedBox {
        let nearer = self.nearer_axis(rectangle);
        nearer.along(&vertical_in_frame(nearer.center, &self.lens, &self.mount))
    }

    /// The foot point of a box, pixels.
    pub fn foot(&self, rectangle: &Rectangle) -> [f64; 2] {
        self.upright(rectangle).foot().into()
    }

    /// The person of a box.
    pub fn observation(&self, rectangle: &Rectangle, score: f64) -> Option<Observation> {
        let upright = self.upright(rectangle);
        let seen = bearing(upright.center, &self.lens)?;
        let foot = upright.foot();
        let floor = floor_position(foot, &self.lens, &self.mount);
        Some(Observation {
            floor_m: floor.map(|place| [place.x_m, place.y_m]),
            azimuth_deg: seen.azimuth.to_degrees(),
            off_axis_deg: seen.off_axis.to_degrees(),
            center_px: upright.center.into(),
            size_px: [upright.width, upright.height],
            foot_px: foot.into(),
            score,
            is_in_margin: false,
            signs: PostureSigns::default(),
        })
    }
}

/// The overlap of two rectangles: the intersection over the union.
pub fn overlap(one: &Rectangle, other: &Rectangle) -> f64 {
    let reach = f64::midpoint(one[2].hypot(one[3]), other[2].hypot(other[3]));
    if (one[0] - other[0]).hypot(one[1] - other[1]) > reach {
        return 0.0;
    }
    let window = corners(other);
    let mut outline: Vec<[f64; 2]> = corners(one).to_vec();
    for (from, to) in window.iter().zip(window.iter().cycle().skip(1)) {
        outline = clipped(&outline, *from, *to);
    }
    let shared = area(&outline);
    shared / (one[2] * one[3] + other[2] * other[3] - shared)
}

fn corners([x, y, width, height, angle]: &Rectangle) -> [[f64; 2]; 4] {
    let turned = OrientedBox::turned(Pixel::new(*x, *y), *width, *height, angle.to_radians());
    turned.corners().map(Into::into)
}

/// Twice the signed area of a triangle.
fn side([x, y]: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    (to[0] - from[0]) * (y - from[1]) - (to[1] - from[1]) * (x - from[0])
}

/// The part of an outline at the inner side of an edge.
fn clipped(outline: &[[f64; 2]], from: [f64; 2], to: [f64; 2]) -> Vec<[f64; 2]> {
    let mut kept = Vec::new();
    for (one, next) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        let (here, there) = (side(*one, from, to), side(*next, from, to));
        if here >= 0.0 {
            kept.push(*one);
        }
        if (here >= 0.0) != (there >= 0.0) {
            let share = here / (here - there);
            kept.push([0, 1].map(|axis| one[axis] + share * (next[axis] - one[axis])));
        }
    }
    kept
}

fn area(outline: &[[f64; 2]]) -> f64 {
    let Some(first) = outline.first() else {
        return 0.0;
    };
    let triangles = outline
        .windows(2)
        .map(|pair| side(pair[1], *first, pair[0]));
    (triangles.sum::<f64>() / 2.0).abs()
}

//! Found persons, drawn into their frame: an oriented box, its axis-aligned box, a label.
//!
//! Sizes grow with the frame, so that a thumbnail and a 3000-pixel frame read alike.

mod canvas;
mod encode;
mod label;
mod lens_sketch;
pub(super) mod text;

use super::frame::Frame;
use canvas::{Outline, Rgb};
pub use encode::{EncodeError, encode_jpeg, encode_png};
pub use lens_sketch::sketch_lens;

/// One thing to draw. All coordinates are frame pixels, corner-origin: pixel i covers
/// [i, i + 1).
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Axis-aligned box: x and y of its top-left corner, then of its bottom-right corner.
    pub bbox: [f64; 4],
    /// The box along the person; where there is one, it is the main outline.
    pub oriented: Option<OrientedMark>,
    /// What the plate at the box says, such as a score; nothing makes no plate.
    pub label: String,
}

/// A rotated box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientedMark {
    /// Column of the centre.
    pub cx: f64,
    /// Row of the centre.
    pub cy: f64,
    /// Extent across the height axis, in pixels.
    pub width: f64,
    /// Extent along the height axis, in pixels.
    pub height: f64,
    /// Clockwise rotation of the height axis from image up, in degrees.
    pub angle_deg: f64,
}

/// Bright enough for dark text, and told apart by most colour-blind people by lightness.
const COLOURS: [Rgb; 6] = [
    [0, 214, 255],
    [255, 200, 30],
    [126, 240, 110],
    [255, 128, 210],
    [255, 146, 72],
    [190, 166, 255],
];
const SHADOW: Rgb = [0, 0, 0];
const SHADOW_OPACITY: f64 = 0.4;
const THIN_OPACITY: f64 = 0.6;
/// Far outside any frame, and near enough for exact distances.
const MAX_COORDINATE: f64 = 1e6;

/// Draws the marks, labels above all boxes. Parts outside the frame are cut off; a mark
/// with a coordinate that is not finite, or beyond a million pixels, is left out.
pub fn annotate(frame: &mut Frame, marks: &[Mark]) {
    let line_width = line_width(frame);
    let drawable = || {
        let colours = COLOURS.into_iter().cycle();
        marks.iter().filter(|mark| mark.is_drawable()).zip(colours)
    };
    for (mark, colour) in drawable() {
        let aligned = aligned_corners(mark.bbox);
        let main = mark.oriented.map_or(aligned, |oriented| oriented.corners());
        let shadow = Outline::new(main, line_width * 1.8);
        shadow.draw(frame, SHADOW, SHADOW_OPACITY);
        if mark.oriented.is_some() {
            Outline::new(aligned, line_width * 0.4).draw(frame, colour, THIN_OPACITY);
        }
        Outline::new(main, line_width).draw(frame, colour, 1.0);
    }
    let mut plates = label::Plates::new(frame);
    for (mark, colour) in drawable() {
        plates.draw(frame, mark, colour);
    }
}

/// Width of the main outline in pixels: a 450th of the shorter side, but visible.
fn line_width(frame: &Frame) -> f64 {
    (f64::from(frame.width().min(frame.height())) / 450.0).max(1.3)
}

fn aligned_corners([left, top, right, bottom]: [f64; 4]) -> [[f64; 2]; 4] {
    [[left, top], [right, top], [right, bottom], [left, bottom]]
}

impl Mark {
    fn is_drawable(&self) -> bool {
        self.corners()
            .all(|corner| corner.into_iter().all(|side| side.abs() <= MAX_COORDINATE))
    }

    /// The corners of both boxes.
    fn corners(&self) -> impl Iterator<Item = [f64; 2]> {
        let oriented = self.oriented.map(|oriented| oriented.corners());
        aligned_corners(self.bbox)
            .into_iter()
            .chain(oriented.into_iter().flatten())
    }
}

impl OrientedMark {
    fn corners(&self) -> [[f64; 2]; 4] {
        let (sin, cos) = self.angle_deg.to_radians().sin_cos();
        [(-0.5, 0.5), (0.5, 0.5), (0.5, -0.5), (-0.5, -0.5)].map(|(across, along)| {
            let (across, along) = (across * self.width, along * self.height);
            [
                self.cx + across * cos + along * sin,
                self.cy + across * sin - along * cos,
            ]
        })
    }
}

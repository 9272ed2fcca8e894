//! Counting lines: named segments in the frame or on the floor, with named directions.

use nalgebra::Point2;

use super::{
    Lens, Mount, Pixel,
    floor::{FloorPosition, pixel_of},
};

/// A line over which persons are counted.
#[derive(Debug, Clone, PartialEq)]
pub struct CountingLine {
    /// Its name.
    pub name: String,
    /// Its two ends.
    pub ends: LineEnds,
    /// The names of the crossings from left to right and from right to left, as seen from the first
    /// end toward the second one. The axes are those of an image: y grows downward.
    pub directions: [String; 2],
}

/// The two ends of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LineEnds {
    /// Corner-origin frame pixels.
    Frame([Point2<f64>; 2]),
    /// Meters, as in [`FloorPosition`].
    Floor([Point2<f64>; 2]),
}

impl CountingLine {
    /// Returns the same line in frames `scale_x`, `scale_y` times as large. The floor is unchanged.
    pub fn scaled(&self, scale_x: f64, scale_y: f64) -> Self {
        let ends = match self.ends {
            LineEnds::Frame(ends) => {
                LineEnds::Frame(ends.map(|end| Point2::new(end.x * scale_x, end.y * scale_y)))
            }
            floor @ LineEnds::Floor(_) => floor,
        };
        Self {
            ends,
            ..self.clone()
        }
    }

    /// Returns points along the line in corner-origin frame pixels, `None` where the lens does not
    /// see the floor. A straight line on the floor is a curve in the frame.
    pub fn outline(&self, lens: &Lens, mount: &Mount, segments: u32) -> Vec<Option<Pixel>> {
        let (LineEnds::Frame([from, to]) | LineEnds::Floor([from, to])) = self.ends;
        let shares = (0..=segments).map(|point| f64::from(point) / f64::from(segments.max(1)));
        let along = shares.map(|share| from + (to - from) * share);
        let in_frame = along.map(|point| match self.ends {
            LineEnds::Frame(_) => Some(point),
            LineEnds::Floor(_) => {
                let (x_m, y_m) = (point.x, point.y);
                pixel_of(FloorPosition { x_m, y_m }, lens, mount)
            }
        });
        in_frame.collect()
    }
}

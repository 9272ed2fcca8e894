//! Plates with text, placed at their boxes where they stay inside the frame and clear of
//! each other.

use super::canvas::{Plate, Rgb};
use super::text::Text;
use super::{Mark, line_width};
use crate::imaging::frame::Frame;

const INK: Rgb = [12, 14, 18];
const PLATE_OPACITY: f64 = 0.92;

/// The plates of one frame.
pub(super) struct Plates {
    text: Text,
    /// Between a box and its plate, in pixels.
    gap: f64,
    frame_size: [f64; 2],
    placed: Vec<Plate>,
}

impl Plates {
    /// No plates yet; sizes fit the frame.
    pub(super) fn new(frame: &Frame) -> Self {
        let frame_size = [f64::from(frame.width()), f64::from(frame.height())];
        Self {
            text: Text::new((frame_size[0].min(frame_size[1]) / 48.0).max(12.0)),
            gap: line_width(frame),
            frame_size,
            placed: Vec::new(),
        }
    }

    /// Draws the label of a mark, unless it is empty.
    pub(super) fn draw(&mut self, frame: &mut Frame, mark: &Mark, colour: Rgb) {
        let text_width = self.text.width(&mark.label);
        if text_width <= 0.0 {
            return;
        }
        let line_height = self.text.height();
        let padding = 0.3 * line_height;
        let height = 1.15 * line_height;
        let plate = self.place(mark, [text_width + 2.0 * padding, height]);
        plate.draw(frame, colour, PLATE_OPACITY);
        let text_top = plate.top + (height - line_height) / 2.0;
        let corner = [plate.left + padding, text_top];
        self.text.write(frame, &mark.label, corner, INK);
        self.placed.push(plate);
    }

    /// Above the boxes where that is free, else below them; else above all the same, moved
    /// into the frame.
    fn place(&self, mark: &Mark, [width, height]: [f64; 2]) -> Plate {
        let extent = |axis: usize, fold: fn(f64, f64) -> f64| {
            let coordinates = mark.corners().map(|corner| corner[axis]);
            coordinates.reduce(fold).unwrap_or_default()
        };
        let (left, right) = (extent(0, f64::min), extent(0, f64::max));
        let (top, bottom) = (extent(1, f64::min), extent(1, f64::max));
        let [columns, rows] = self.frame_size;
        let (above, below) = (top - self.gap - height, bottom + self.gap);
        let at = |left: f64, top: f64| Plate {
            left: left.min(columns - width).max(0.0),
            top,
            width,
            height,
            radius: 0.22 * height,
        };
        [
            at(left, above),
            at(right - width, above),
            at(left, below),
            at(right - width, below),
        ]
        .into_iter()
        .filter(|plate| plate.top >= 0.0 && plate.top + height <= rows)
        .find(|plate| !self.placed.iter().any(|other| plate.overlaps(other)))
        .unwrap_or_else(|| at(left, above.min(rows - height).max(0.0)))
    }
}

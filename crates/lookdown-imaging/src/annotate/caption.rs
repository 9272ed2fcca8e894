//! Lines of text on a dark plate, such as the caption in the corner of the frame.

use super::{
    canvas::{Plate, Rgb},
    line_width,
    text::Text,
    text_height,
};
use crate::frame::Frame;

const BACKGROUND: Rgb = [0, 0, 0];
const BACKGROUND_OPACITY: f64 = 0.6;
/// Color of a caption of one line.
const INK: Rgb = [255, 255, 255];
/// Distance between the text and the left and right edges of its plate, in text heights.
const PADDING: f64 = 0.4;
/// Distance between the text and the upper and lower edges of its plate, in text heights.
const VERTICAL_PADDING: f64 = 0.2;

/// Lines of text with their colors.
#[derive(Debug, Clone, Copy)]
pub struct Caption<'a> {
    /// The lines from top to bottom, each with its color.
    pub lines: &'a [(&'a str, [u8; 3])],
    /// Upper left corner of the plate, corner-origin frame pixels.
    pub corner: [f64; 2],
    /// Height of a line of text, pixels.
    pub text_height: f64,
}

impl Caption<'_> {
    /// Draws the plate and the text, reduced to the width of the frame if necessary.
    pub fn draw(&self, frame: &mut Frame) {
        self.draw_plate(frame);
    }

    /// Draws like [`Caption::draw`], and returns the plate.
    fn draw_plate(&self, frame: &mut Frame) -> Plate {
        let [left, top] = self.corner;
        let mut text = Text::new(self.text_height);
        let widths = self.lines.iter().map(|(line, _)| text.width(line));
        let mut width = widths.fold(0.0, f64::max) + 2.0 * PADDING * text.height();
        let room = (f64::from(frame.width()) - 2.0 * left).max(1.0);
        if width > room {
            text = Text::new(text.height() * room / width);
            width = room;
        }
        let line_height = text.height();
        let mut line_top = top + VERTICAL_PADDING * line_height;
        let height = (self.lines.len() as f64 + 2.0 * VERTICAL_PADDING) * line_height;
        let plate = Plate {
            left,
            top,
            width,
            height,
            radius: 0.25 * line_height,
        };
        plate.draw(frame, BACKGROUND, BACKGROUND_OPACITY);
        for (line, ink) in self.lines {
            let corner = [left + PADDING * line_height, line_top];
            text.write(frame, line, corner, *ink);
            line_top += line_height;
        }
        plate
    }
}

/// Writes a line into the corner of the frame, and returns the plate behind it.
pub(super) fn draw(frame: &mut Frame, caption: &str) -> Option<Plate> {
    if caption.is_empty() {
        return None;
    }
    let margin = 2.0 * line_width(frame);
    let caption = Caption {
        lines: &[(caption, INK)],
        corner: [margin; 2],
        text_height: text_height(frame),
    };
    Some(caption.draw_plate(frame))
}

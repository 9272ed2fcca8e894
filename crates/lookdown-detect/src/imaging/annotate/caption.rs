//! A line of text in the corner of the frame.

use super::{
    canvas::{Plate, Rgb},
    line_width,
    text::Text,
    text_height,
};
use crate::imaging::frame::Frame;

const BACKGROUND: Rgb = [0, 0, 0];
const BACKGROUND_OPACITY: f64 = 0.6;
const INK: Rgb = [255, 255, 255];
/// Distance between the text and the edge of its plate, in text heights.
const PADDING: f64 = 0.4;

/// Writes the text, reduced to the frame's width if necessary, and returns the plate behind it.
pub(super) fn draw(frame: &mut Frame, caption: &str) -> Option<Plate> {
    let mut text = Text::new(text_height(frame));
    let mut width = text.width(caption) + 2.0 * PADDING * text.height();
    if caption.is_empty() {
        return None;
    }
    let margin = 2.0 * line_width(frame);
    let room = (f64::from(frame.width()) - 2.0 * margin).max(1.0);
    if width > room {
        text = Text::new(text.height() * room / width);
        width = room;
    }
    let line_height = text.height();
    let plate = Plate {
        left: margin,
        top: margin,
        width,
        height: 1.4 * line_height,
        radius: 0.25 * line_height,
    };
    plate.draw(frame, BACKGROUND, BACKGROUND_OPACITY);
    let corner = [margin + PADDING * line_height, margin + 0.2 * line_height];
    text.write(frame, caption, corner, INK);
    Some(plate)
}

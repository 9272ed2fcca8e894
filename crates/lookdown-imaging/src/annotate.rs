//! Annotated frames: an oriented box, an axis-aligned box and a label for each person, and zones.
//!
//! Sizes scale with the frame, so that a thumbnail and a 4000-pixel frame are equally legible.

mod area_sketch;
mod canvas;
mod caption;
mod conceal;
mod effort;
mod encode;
mod label;
mod mark;
mod room_sketch;
mod style;
mod text;

use super::frame::Frame;
pub use area_sketch::{
    ZoneOutline, sketch_areas, sketch_foot_filter, sketch_line_outlines, sketch_lines,
};
use canvas::{Rgb, Stroke};
pub use caption::Caption;
pub use conceal::{Concealment, conceal};
pub use effort::Cancelled;
use effort::Effort;
pub use encode::{EncodeError, encode_jpeg, encode_png};
pub use mark::{Head, Mark, OrientedMark};
pub use room_sketch::{ROOM_LEGEND, sketch_lens, sketch_room};
use style::{INK, is_drawable, line_width, text_height};

/// Shapes and texts to draw into a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// The marks, the most important first. Marks beyond [`MOST_MARKS`] are left out.
    pub marks: Vec<Mark>,
    /// True to draw the axis-aligned boxes.
    pub boxes: bool,
    /// True to draw the oriented boxes, which are then the main outlines.
    pub oriented: bool,
    /// Thin lines below all marks, corner-origin frame pixels.
    pub lines: Vec<Vec<[f64; 2]>>,
    /// Zones with their names, above the lines and below all marks.
    pub zones: Vec<ZoneOutline>,
    /// Text in the top left corner. Empty draws no caption.
    pub caption: String,
}

/// Most marks drawn. More cannot be distinguished in an image.
pub const MOST_MARKS: usize = 1000;

/// Bright enough for dark text, and distinguishable by lightness for most color-blind people.
const COLORS: [Rgb; 6] = [
    [0, 214, 255],
    [255, 200, 30],
    [126, 240, 110],
    [255, 128, 210],
    [255, 146, 72],
    [190, 166, 255],
];
/// A dark line on both sides of each outline makes it stand out from floors of the same brightness.
const SHADOW: Rgb = [0, 0, 0];
const SHADOW_OPACITY: f64 = 0.7;
const THIN_OPACITY: f64 = 0.6;
const LINE: Rgb = [235, 240, 255];
const LINE_OPACITY: f64 = 0.55;

impl Drawing {
    /// A drawing of both boxes of the marks, without lines, zones or a caption.
    pub fn new(marks: Vec<Mark>) -> Self {
        Self {
            marks,
            boxes: true,
            oriented: true,
            lines: Vec::new(),
            zones: Vec::new(),
            caption: String::new(),
        }
    }
}

/// Draws into the frame, labels above all boxes. Parts outside the frame are cut off. A mark or
/// line with a coordinate that is not finite, or beyond a million pixels, is left out.
///
/// The work is bounded: lines, zones, marks and labels are drawn in this order until the number of
/// painted pixels is twice the number of pixels of the frame. The rest is left out.
pub fn annotate(frame: &mut Frame, drawing: &Drawing) {
    // Without cancellation it cannot fail.
    let _ = annotate_unless(frame, drawing, &|| false);
}

/// Draws like [`annotate`] and calls `is_cancelled` before each shape.
///
/// # Errors
/// [`Cancelled`] as soon as `is_cancelled` returns true. The frame is then partly drawn.
pub fn annotate_unless(
    frame: &mut Frame,
    drawing: &Drawing,
    is_cancelled: &dyn Fn() -> bool,
) -> Result<(), Cancelled> {
    let mut effort = Effort::new(frame.width(), frame.height(), is_cancelled);
    let line_width = line_width(frame);
    for line in drawing.lines.iter().filter(|line| is_drawable(line)) {
        if !effort.allows_more()? {
            break;
        }
        for pair in line.windows(2) {
            let stroke = Stroke::new(pair[0], pair[1], (0.4 * line_width).max(1.0));
            effort.spend(stroke.draw(frame, LINE, LINE_OPACITY));
        }
    }
    for zone in &drawing.zones {
        if !effort.allows_more()? {
            break;
        }
        effort.spend(zone.draw(frame, 0.6 * line_width));
    }
    let marks = drawing.marks.iter().take(MOST_MARKS);
    let mut marks: Vec<_> = marks
        .filter(|mark| mark.is_drawable())
        .zip(COLORS.into_iter().cycle())
        .collect();
    for (mark, color) in &marks {
        if !effort.allows_more()? {
            break;
        }
        let oriented = mark.oriented.filter(|_| drawing.oriented);
        let oriented = oriented.map(|oriented| oriented.corners());
        let aligned = drawing.boxes.then(|| mark.aligned_corners());
        let Some(main) = oriented.or(aligned) else {
            continue;
        };
        let shadow_width = line_width + 2.0 * (0.5 * line_width).max(1.2);
        let shadow = Stroke::around(main, shadow_width);
        effort.spend(shadow.draw(frame, SHADOW, SHADOW_OPACITY));
        if let (Some(_), Some(aligned)) = (oriented, aligned) {
            let thin = Stroke::around(aligned, line_width * 0.4);
            effort.spend(thin.draw(frame, *color, THIN_OPACITY));
        }
        effort.spend(Stroke::around(main, line_width).draw(frame, *color, 1.0));
    }
    let caption = caption::draw(frame, &drawing.caption);
    let names: Vec<_> = drawing.zones.iter().filter_map(ZoneOutline::mark).collect();
    marks.extend(names.iter().map(|name| (name, area_sketch::ZONE)));
    label::Labels::new(frame, &marks, caption).draw(frame, &mut effort)
}

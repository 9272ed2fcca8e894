//! Zones and masks drawn into a frame of their camera.

use lookdown_lens::geometry::{
    CountingLine, FootFilter, Lens, Mount, Pixel, Polygon, Zone, hull::hull,
};
use serde::{Deserialize, Serialize};

use super::{
    Mark,
    canvas::{Rgb, Stroke},
    effort::Effort,
    is_drawable,
    label::Labels,
    line_width,
};
use crate::{Frame, MaskedPixels};

pub(super) const ZONE: Rgb = [126, 240, 110];
const MASK: Rgb = [255, 128, 210];
const LINE: Rgb = [255, 214, 60];
const AREA: Rgb = [90, 200, 255];
const IGNORE: Rgb = [255, 90, 70];
/// Straight edges on the floor are curves in the frame.
const POINTS_PER_EDGE: u32 = 32;

/// A zone, projected into a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ZoneOutline {
    /// Its name.
    pub name: String,
    /// Its border in corner-origin frame pixels, in several pieces where the lens shows only parts.
    pub lines: Vec<Vec<[f64; 2]>>,
}

impl ZoneOutline {
    /// The outline of a zone given in frame pixels, or on the floor and projected through `lens`.
    pub fn new(zone: &Zone, lens: &Lens, mount: &Mount) -> Self {
        Self::in_pieces(&zone.name, &zone.area.outline(lens, mount, POINTS_PER_EDGE))
    }

    /// A counting line given in frame pixels, or on the floor and projected through `lens`.
    pub fn for_line(line: &CountingLine, lens: &Lens, mount: &Mount) -> Self {
        Self::in_pieces(&line.name, &line.outline(lens, mount, POINTS_PER_EDGE))
    }

    /// The outline of these points, cut where the lens does not see them.
    fn in_pieces(name: &str, outline: &[Option<Pixel>]) -> Self {
        let pieces = outline.split(Option::is_none);
        let lines = pieces.map(|piece| piece.iter().flatten().map(|at| [at.x, at.y]).collect());
        Self {
            name: name.to_owned(),
            lines: lines.filter(|line: &Vec<_>| !line.is_empty()).collect(),
        }
    }

    /// Draws its border. Returns the number of painted pixels.
    pub(super) fn draw(&self, frame: &mut Frame, width: f64) -> u64 {
        self.draw_in(frame, width, ZONE)
    }

    fn draw_in(&self, frame: &mut Frame, width: f64, color: Rgb) -> u64 {
        let lines = self.lines.iter().filter(|line| is_drawable(line));
        let pairs = lines.flat_map(|line| line.windows(2));
        pairs
            .map(|pair| Stroke::new(pair[0], pair[1], width).draw(frame, color, 1.0))
            .sum()
    }

    /// A mark with its name at its bounding box, or `None` when no part of it is visible.
    pub(super) fn mark(&self) -> Option<Mark> {
        let points = self.lines.iter().flatten().map(|&[x, y]| [x, y, x, y]);
        let mark = Mark::new(points.reduce(hull)?, &self.name);
        mark.is_drawable().then_some(mark)
    }
}

/// Blanks the pixels under `masks` and outlines the masks, then draws `zones` with their names.
/// Both are in frame pixels or on the floor and projected through `lens`.
pub fn sketch_areas(
    frame: &mut Frame,
    zones: &[Zone],
    masks: &[Polygon],
    lens: &Lens,
    mount: &Mount,
) {
    MaskedPixels::new(masks, frame.width(), frame.height()).blank(frame);
    let width = line_width(frame);
    for mask in masks {
        for [from, to] in mask.edges() {
            Stroke::new(from.into(), to.into(), width).draw(frame, MASK, 1.0);
        }
    }
    let zones = zones.iter().map(|zone| ZoneOutline::new(zone, lens, mount));
    let zones: Vec<_> = zones.collect();
    sketch_outlines(frame, &zones, ZONE);
}

/// Draws the outlines of areas and of ignored places.
pub fn sketch_foot_filter(frame: &mut Frame, filter: &FootFilter, lens: &Lens, mount: &Mount) {
    for (places, name, color) in [
        (&filter.areas, "area", AREA),
        (&filter.ignore, "ignore", IGNORE),
    ] {
        let outlines = places.iter().map(|place| {
            ZoneOutline::in_pieces(name, &place.outline(lens, mount, POINTS_PER_EDGE))
        });
        let outlines: Vec<_> = outlines.collect();
        sketch_outlines(frame, &outlines, color);
    }
}

/// Draws counting lines with their names. They are in frame pixels or on the floor and projected
/// through `lens`.
pub fn sketch_lines(frame: &mut Frame, lines: &[CountingLine], lens: &Lens, mount: &Mount) {
    let outlines = lines.iter();
    let outlines = outlines.map(|line| ZoneOutline::for_line(line, lens, mount));
    sketch_line_outlines(frame, &outlines.collect::<Vec<_>>());
}

/// Draws the outlines of counting lines with their names.
pub fn sketch_line_outlines(frame: &mut Frame, outlines: &[ZoneOutline]) {
    sketch_outlines(frame, outlines, LINE);
}

/// Draws outlines with their names in a color.
fn sketch_outlines(frame: &mut Frame, outlines: &[ZoneOutline], color: Rgb) {
    let width = line_width(frame);
    for outline in outlines {
        outline.draw_in(frame, width, color);
    }
    let names: Vec<_> = outlines.iter().filter_map(ZoneOutline::mark).collect();
    let names: Vec<_> = names.iter().map(|name| (name, color)).collect();
    let mut effort = Effort::new(frame.width(), frame.height(), &|| false);
    // This drawing is never cancelled.
    let _ = Labels::new(frame, &names, None).draw(frame, &mut effort);
}

#[cfg(test)]
mod tests {
    use lookdown_lens::geometry::{LineEnds, ZoneArea};

    use super::*;

    #[test]
    fn masks_are_black_and_zones_are_outlined_with_their_names() {
        let mut frame = Frame::new(200, 200, vec![90; 3 * 200 * 200]).unwrap();
        let lens = Lens::equidistant_circle(99.5, 99.5, 100.0, 1.5).unwrap();
        let square = |left: f64, right: f64| {
            let corners = [[left, left], [right, left], [right, right], [left, right]];
            Polygon::new(&corners).unwrap()
        };
        let mount = Mount::new(-nalgebra::Vector3::z_axis(), Some(3.0));
        let zones = [
            ("frame", ZoneArea::Frame(square(120.0, 150.0))),
            ("floor", ZoneArea::Floor(square(-1.0, 1.0))),
        ]
        .map(|(name, area)| Zone {
            name: name.to_owned(),
            area,
            is_lying_expected: false,
        });
        sketch_areas(&mut frame, &zones, &[square(10.0, 50.0)], &lens, &mount);
        assert_eq!(frame.pixel(30, 30), [0; 3]);
        assert_ne!(frame.pixel(10, 30), [0; 3]);
        assert_ne!(frame.pixel(120, 135), [90; 3]);
        // A meter to the left of the camera and 3 m below it, on an equidistant lens.
        let left = 100.0 - 100.0 / 1.5 * (1.0_f64 / 3.0).atan();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a pixel position"
        )]
        let left = left as u32;
        assert_ne!(frame.pixel(left, 100), [90; 3]);
        assert_eq!(frame.pixel(60, 150), [90; 3]);
    }

    #[test]
    fn counting_lines_are_drawn() {
        let mut frame = Frame::new(200, 200, vec![90; 3 * 200 * 200]).unwrap();
        let lens = Lens::equidistant_circle(99.5, 99.5, 100.0, 1.5).unwrap();
        let mount = Mount::new(-nalgebra::Vector3::z_axis(), Some(3.0));
        let line = CountingLine {
            name: "door".to_owned(),
            ends: LineEnds::Floor([Pixel::new(0.0, 1.0), Pixel::new(0.0, 3.0)]),
            directions: ["in".to_owned(), "out".to_owned()],
        };
        sketch_lines(&mut frame, &[line], &lens, &mount);
        assert_ne!(frame.pixel(100, 140), [90; 3]);
        assert_eq!(frame.pixel(140, 100), [90; 3]);
    }
}

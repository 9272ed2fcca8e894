//! Text plates next to their boxes, inside the frame, clear of each other and of heads.

use super::{
    INK, Mark,
    canvas::{Plate, Rgb},
    effort::{Cancelled, Effort},
    line_width,
    text::Text,
    text_height,
};
use crate::frame::Frame;

const PLATE_OPACITY: f64 = 0.92;
/// Costs of covering another plate, a head or a box, per covered share of the plate.
const COST_OF_PLATE: f64 = 4.0;
const COST_OF_HEAD: f64 = 3.0;
const COST_OF_BOX: f64 = 1.0;
/// Additional cost per position in the list of candidate positions.
const COST_OF_PLACE: f64 = 0.02;

/// The labels of one frame.
pub(super) struct Labels<'a> {
    marks: &'a [(&'a Mark, Rgb)],
    heads: Vec<[f64; 4]>,
    boxes: Vec<[f64; 4]>,
    text: Text,
    /// Distance between a box and its plate, in pixels.
    gap: f64,
    frame_size: [f64; 2],
    placed: Vec<Plate>,
}

impl<'a> Labels<'a> {
    /// Labels for the marks that keep clear of `taken`. Sizes fit the frame.
    pub(super) fn new(frame: &Frame, marks: &'a [(&'a Mark, Rgb)], taken: Option<Plate>) -> Self {
        let heads = marks.iter().filter_map(|(mark, _)| mark.head);
        let heads = heads.map(|head| {
            let (x, y, radius) = (head.cx, head.cy, head.radius);
            [x - radius, y - radius, x + radius, y + radius]
        });
        Self {
            marks,
            heads: heads.collect(),
            boxes: marks.iter().map(|(mark, _)| mark.extent()).collect(),
            text: Text::new(text_height(frame)),
            gap: line_width(frame),
            frame_size: [f64::from(frame.width()), f64::from(frame.height())],
            placed: taken.into_iter().collect(),
        }
    }

    /// Draws the labels that are not empty. If `effort` does not allow all, the last ones are left
    /// out.
    pub(super) fn draw(
        mut self,
        frame: &mut Frame,
        effort: &mut Effort<'_>,
    ) -> Result<(), Cancelled> {
        for (mark, color) in self.marks {
            if !effort.allows_more()? {
                break;
            }
            let text_width = self.text.width(&mark.label);
            if text_width <= 0.0 {
                continue;
            }
            let line_height = self.text.height();
            let padding = 0.3 * line_height;
            let height = 1.15 * line_height;
            let plate = self.place(mark, [text_width + 2.0 * padding, height]);
            effort.spend(plate.draw(frame, *color, PLATE_OPACITY));
            let text_top = plate.top + (height - line_height) / 2.0;
            let corner = [plate.left + padding, text_top];
            effort.spend(self.text.write(frame, &mark.label, corner, INK));
            self.placed.push(plate);
        }
        Ok(())
    }

    /// The position next to the boxes with the lowest cost. Above them, if all costs are equal.
    fn place(&self, mark: &Mark, [width, height]: [f64; 2]) -> Plate {
        let [left, top, right, bottom] = mark.extent();
        let (above, below) = (top - self.gap - height, bottom + self.gap);
        let (at_left, at_right) = (left - self.gap - width, right + self.gap);
        let middle = f64::midpoint(top, bottom) - height / 2.0;
        let corners = [
            [left, above],
            [right - width, above],
            [left, below],
            [right - width, below],
            [at_right, middle],
            [at_left, middle],
            [at_right, above],
            [at_left, above],
            [at_right, below],
            [at_left, below],
        ];
        let [columns, rows] = self.frame_size;
        let plates = corners.map(|[left, top]| Plate {
            left: left.min(columns - width).max(0.0),
            top: top.min(rows - height).max(0.0),
            width,
            height,
            radius: 0.22 * height,
        });
        let (mut best, mut lowest) = (plates[0], f64::INFINITY);
        for (index, plate) in (0_u32..).zip(plates) {
            let cost = COST_OF_PLACE * f64::from(index) + self.cost(&plate);
            if cost < lowest {
                (best, lowest) = (plate, cost);
            }
        }
        best
    }

    /// The cost of the areas that the plate would cover.
    fn cost(&self, plate: &Plate) -> f64 {
        let covered =
            |areas: &[[f64; 4]]| -> f64 { areas.iter().map(|area| plate.shared_area(area)).sum() };
        let plates: f64 = self
            .placed
            .iter()
            .map(|other| plate.shared_area(&other.corners()))
            .sum();
        let covered = COST_OF_PLATE * plates
            + COST_OF_HEAD * covered(&self.heads)
            + COST_OF_BOX * covered(&self.boxes);
        covered / (plate.width * plate.height)
    }
}

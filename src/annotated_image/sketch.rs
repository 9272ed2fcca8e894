//! The drawings for a frame, stored separately from the frame.
//!
//! The mark of a person in the frame.

use lookdown_detect::pipeline::{DetectedFrame, DetectionReport, Person};
use lookdown_imaging::annotate::{Drawing, Head, Mark, OrientedMark, ZoneOutline};
use lookdown_lens::geometry::OrientedBox;
use serde::{Deserialize, Serialize};

use super::Layer;

/// The drawings for a frame. All positions are corner-origin pixels of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Sketch {
    frame_width: u32,
    /// The persons, with their scores.
    marks: Vec<Mark>,
    /// Boxes that hide people who are in no result; frames of earlier versions have none.
    #[serde(default)]
    others: Vec<[f64; 4]>,
    views: Vec<Vec<[f64; 2]>>,
    zones: Vec<ZoneOutline>,
    timestamp: String,
}

impl Sketch {
    /// Selects what these layers need from a detection.
    pub(super) fn new(detected: &DetectedFrame, layers: &[Layer]) -> Self {
        let report = &detected.report;
        let views = layers.contains(&Layer::Views);
        let views = views.then(|| detected.view_outlines());
        let views = views.into_iter().flatten();
        let zones = layers.contains(&Layer::Zones);
        let zones = zones.then(|| detected.zone_outlines());
        Self {
            frame_width: detected.frame.width(),
            marks: report.persons.iter().map(mark).collect(),
            others: detected.boxes_of_others(),
            views: views
                .map(|outline| outline.iter().map(|at| [at.x, at.y]).collect())
                .collect(),
            zones: zones.unwrap_or_default(),
            timestamp: timestamp(report),
        }
    }

    /// Rounds lines to a tenth of a pixel: the error is invisible, and the text takes a third of
    /// the space.
    pub(super) fn rounded(mut self) -> Self {
        for coordinate in self.lines().flatten().flatten() {
            *coordinate = (*coordinate * 10.0).round() / 10.0;
        }
        self
    }

    /// The marks of all people to be concealed, in pixels of an image of this width: also of those
    /// who are in no result.
    pub(super) fn concealed(&self, image_width: u32) -> Vec<Mark> {
        let factor = f64::from(image_width) / f64::from(self.frame_width.max(1));
        let others = self.others.iter().map(|&bbox| Mark::new(bbox, ""));
        let marks = self.marks.iter().cloned().chain(others);
        marks.map(|mark| mark.scaled(factor)).collect()
    }

    /// The drawing of these layers, in pixels of an image of this width.
    pub(super) fn drawing(&self, image_width: u32, layers: &[Layer]) -> Drawing {
        let factor = f64::from(image_width) / f64::from(self.frame_width.max(1));
        let draws = |layer| layers.contains(&layer);
        let mut sketch = self.clone();
        for coordinate in sketch.lines().flatten().flatten() {
            *coordinate *= factor;
        }
        let marks = sketch.marks.into_iter().map(|mark| {
            let mark = mark.scaled(factor);
            let label = if draws(Layer::Scores) {
                mark.label
            } else {
                String::new()
            };
            Mark { label, ..mark }
        });
        Drawing {
            marks: marks.collect(),
            boxes: draws(Layer::Boxes),
            oriented: draws(Layer::Oriented),
            lines: wanted(draws(Layer::Views), sketch.views),
            zones: wanted(draws(Layer::Zones), sketch.zones),
            caption: wanted(draws(Layer::Timestamp), sketch.timestamp),
        }
    }

    fn lines(&mut self) -> impl Iterator<Item = &mut Vec<[f64; 2]>> {
        let zones = self.zones.iter_mut().flat_map(|zone| &mut zone.lines);
        self.views.iter_mut().chain(zones)
    }
}

fn wanted<T: Default>(is_wanted: bool, what: T) -> T {
    if is_wanted { what } else { T::default() }
}

/// The time at which the frame was taken, or else received, to the second.
fn timestamp(report: &DetectionReport) -> String {
    let time = report.captured_at.unwrap_or(report.received_at);
    time.strftime("%Y-%m-%d %H:%M:%S UTC").to_string()
}

/// The person's mark, with the score on its label.
pub(super) fn mark(person: &Person) -> Mark {
    let oriented = &person.oriented_box;
    Mark {
        bbox: person.bbox.corners(),
        oriented: Some(OrientedMark {
            cx: oriented.center.x,
            cy: oriented.center.y,
            width: oriented.width,
            height: oriented.height,
            angle_deg: oriented.angle.to_degrees(),
        }),
        head: Some(head(oriented)),
        label: format!("{:.2}", person.score),
    }
}

/// The circle that touches the upper short side and both long sides of the box.
fn head(oriented: &OrientedBox) -> Head {
    let radius = oriented.width.min(oriented.height) / 2.0;
    let center = oriented.center + oriented.up * (oriented.height / 2.0 - radius);
    Head {
        cx: center.x,
        cy: center.y,
        radius,
    }
}

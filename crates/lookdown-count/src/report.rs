//! The parts of a report of the server that are used.

use jiff::Timestamp;
use lookdown_lens::geometry::{Pixel, oriented_box::vertical_in_frame};
use nalgebra::Vector2;
use serde::Deserialize;

use crate::{Observation, definition::CameraDefinition};

/// The capture time may be this much after the arrival, milliseconds: clocks differ.
const MAX_AHEAD_MS: i64 = 5_000;
/// The capture time may be this much before the arrival, milliseconds.
const MAX_BEHIND_MS: i64 = 3_600_000;

/// A report of the server.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct Report {
    /// The camera of the frame.
    pub(crate) camera: String,
    received_at: Timestamp,
    #[serde(default)]
    captured_at: Option<Timestamp>,
    pub(crate) calibration: UsedCalibration,
    pub(crate) image: Image,
    pub(crate) persons: Vec<Person>,
}

/// The calibration of a report.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub(crate) struct UsedCalibration {
    pub(crate) id: String,
    pub(crate) revision: String,
    pub(crate) assumed: bool,
}

/// The size of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub(crate) struct Image {
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// One person.
#[derive(Debug, Clone, Copy, Deserialize)]
pub(crate) struct Person {
    score: f64,
    oriented_box: OrientedBox,
    bearing: Option<Bearing>,
    floor: Option<Floor>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
struct OrientedBox {
    cx: f64,
    cy: f64,
    height: f64,
    angle_deg: f64,
}

#[derive(Debug, Clone, Copy, Deserialize)]
struct Bearing {
    azimuth_deg: f64,
    off_axis_deg: f64,
}

#[derive(Debug, Clone, Copy, Deserialize)]
struct Floor {
    x_m: f64,
    y_m: f64,
}

impl Report {
    /// Returns the report of a frame that was captured at this time, whenever it arrived.
    pub(crate) fn captured(self, at: Timestamp) -> Self {
        Self {
            received_at: at,
            captured_at: None,
            ..self
        }
    }

    /// Returns the time of the frame in milliseconds since the Unix epoch: the capture time if it
    /// is plausible, else the arrival.
    pub(crate) fn at_ms(&self) -> i64 {
        let received = self.received_at.as_millisecond();
        let plausible =
            received.saturating_sub(MAX_BEHIND_MS)..=received.saturating_add(MAX_AHEAD_MS);
        let captured = self.captured_at.map(Timestamp::as_millisecond);
        captured
            .filter(|captured| plausible.contains(captured))
            .unwrap_or(received)
    }

    /// Returns the persons as the tracker needs them. A person without a direction is left out.
    pub(crate) fn observations(&self, definition: &CameraDefinition) -> Vec<Observation> {
        let persons = self.persons.iter();
        persons
            .filter_map(|person| self.observation(person, definition))
            .collect()
    }

    fn observation(&self, person: &Person, definition: &CameraDefinition) -> Option<Observation> {
        let bearing = person.bearing?;
        let OrientedBox {
            cx,
            cy,
            height,
            angle_deg,
        } = person.oriented_box;
        let centre = Pixel::new(cx, cy);
        // The angle does not tell the head from the foot.
        let vertical = if let Some(camera) = &definition.geometry {
            vertical_in_frame(centre, &camera.lens, &camera.mount)
        } else {
            let Image { width, height } = self.image;
            centre - Pixel::new(f64::from(width) / 2.0, f64::from(height) / 2.0)
        };
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let axis = Vector2::new(sin, -cos);
        let up = if axis.dot(&vertical) < 0.0 {
            -axis
        } else {
            axis
        };
        let foot = centre - up * (height / 2.0);
        Some(Observation {
            floor_m: person.floor.map(|floor| [floor.x_m, floor.y_m]),
            azimuth_deg: bearing.azimuth_deg,
            off_axis_deg: bearing.off_axis_deg,
            centre_px: [cx, cy],
            foot_px: [foot.x, foot.y],
            score: person.score,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(captured_at: &str, person: &str) -> Report {
        serde_json::from_str(&format!(
            r#"{{"camera": "hall", "received_at": "2026-11-22T10:00:00Z", "captured_at": {captured_at},
                 "calibration": {{"id": "hall", "revision": "1", "assumed": true}},
                 "image": {{"width": 200, "height": 200}}, "persons": [{person}], "warnings": []}}"#
        ))
        .unwrap()
    }

    #[test]
    fn an_implausible_capture_time_is_replaced_by_the_arrival() {
        let received = report("null", "").at_ms();
        for (captured, offset) in [
            ("\"2026-11-22T09:59:58.5Z\"", -1500),
            ("\"2026-11-22T10:00:04Z\"", 4000),
            ("\"2026-11-22T11:00:00Z\"", 0),
            ("\"2020-01-01T00:00:00Z\"", 0),
        ] {
            assert_eq!(
                report(captured, "").at_ms() - received,
                offset,
                "{captured}"
            );
        }
    }

    #[test]
    fn the_foot_is_toward_the_nadir() {
        let definition = CameraDefinition::unknown();
        for (angle_deg, cx, foot) in [
            (90.0, 150.0, 130.0),
            (-90.0, 150.0, 130.0),
            (90.0, 50.0, 70.0),
        ] {
            let person = format!(
                r#"{{"score": 0.8, "floor": null, "bearing": {{"azimuth_deg": 0, "off_axis_deg": 40}},
                    "oriented_box": {{"cx": {cx}, "cy": 100, "width": 20, "height": 40,
                                      "angle_deg": {angle_deg}}}}}"#
            );
            let persons = report("null", &person).observations(&definition);
            assert!((persons[0].foot_px[0] - foot).abs() < 1e-9, "{persons:?}");
        }
    }
}

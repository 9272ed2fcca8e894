//! The reports of the server.

use jiff::Timestamp;
use lookdown_calibration::CalibrationId;
use lookdown_common::{
    report::{Report, ReportCalibration, ReportImage, ReportPerson},
    text::is_camera_name,
};
use lookdown_lens::geometry::{
    BoxAngles, FloorVotes, OrientedBox, Pixel, PostureSigns, floor::floor_position,
};
use lookdown_tracking::Observation;
use serde::{Deserialize, Serialize};

use crate::definition::{CameraDefinition, DefinitionKey};

/// The capture time of a camera alone may be this much after and before the arrival, milliseconds.
const MAX_AHEAD_MS: i64 = 5_000;
const MAX_BEHIND_MS: i64 = 3_600_000;
/// The same for a camera of a site, whose cameras share one time. Together they are less than
/// `TrackerSettings::max_lateness_s`, so that the clock of one camera never makes others late.
const MAX_AHEAD_ON_SITE_MS: i64 = 500;
const MAX_BEHIND_ON_SITE_MS: i64 = 1_000;

/// The server's limit of revisions.
const MAX_REVISION_BYTES: usize = 128;

/// The fields of a report that counting needs, with the times as numbers.
#[derive(Debug, Clone, Deserialize)]
#[serde(try_from = "Report")]
pub(crate) struct ReceivedReport {
    /// The camera of the frame.
    pub(crate) camera: String,
    received_at: Timestamp,
    captured_at: Option<Timestamp>,
    pub(crate) calibration: ReportCalibration,
    pub(crate) image: ReportImage,
    pub(crate) persons: Vec<ReportPerson>,
    /// Persons in the margin around the areas of the calibration.
    margin: Vec<ReportPerson>,
}

/// The ID and the arrival of a report: the same for each time that the server sends it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct ReportKey {
    event: u64,
    received_ms: i64,
}

impl ReportKey {
    /// Returns the ID of the report.
    pub(crate) fn event(self) -> u64 {
        self.event
    }
}

impl TryFrom<Report> for ReceivedReport {
    type Error = jiff::Error;

    fn try_from(report: Report) -> Result<Self, Self::Error> {
        Ok(Self {
            camera: report.camera,
            received_at: report.received_at.parse()?,
            captured_at: report.captured_at.map(|time| time.parse()).transpose()?,
            calibration: report.calibration,
            image: report.image,
            persons: report.persons,
            margin: report.margin.unwrap_or_default(),
        })
    }
}

impl ReceivedReport {
    /// Returns the report of a frame that was captured at this time, whenever it arrived.
    pub(crate) fn captured(self, at: Timestamp) -> Self {
        Self {
            received_at: at,
            captured_at: None,
            ..self
        }
    }

    /// Returns true if the server permits such names.
    pub(crate) fn has_valid_names(&self) -> bool {
        let used = &self.calibration;
        is_camera_name(&self.camera)
            && (used.assumed || used.id.parse::<CalibrationId>().is_ok())
            && used.revision.len() <= MAX_REVISION_BYTES
    }

    /// Returns the time of the frame in milliseconds since the Unix epoch: the capture time if it
    /// is plausible, else the arrival.
    pub(crate) fn at_ms(&self, is_on_site: bool) -> i64 {
        let arrival = self.received_at.as_millisecond();
        match self.ahead_ms() {
            Some(ahead_ms) if is_plausible(ahead_ms, is_on_site) => arrival + ahead_ms,
            _ => arrival,
        }
    }

    /// Returns by how much the clock of a camera differs from the server's, milliseconds, if its
    /// capture times are therefore not used.
    pub(crate) fn clock_difference_ms(&self, is_on_site: bool) -> Option<i64> {
        let ahead_ms = self.ahead_ms();
        ahead_ms.filter(|ahead_ms| !is_plausible(*ahead_ms, is_on_site))
    }

    /// Returns the time from the arrival to the capture: less than 0 unless clocks differ.
    fn ahead_ms(&self) -> Option<i64> {
        let captured = self.captured_at?.as_millisecond();
        Some(captured - self.received_at.as_millisecond())
    }

    /// Returns what identifies the report among those of its camera.
    pub(crate) fn key(&self, event: u64) -> ReportKey {
        ReportKey {
            event,
            received_ms: self.received_at.as_millisecond(),
        }
    }

    /// Returns what identifies the definition of the camera for this report.
    pub(crate) fn definition_key(&self) -> DefinitionKey {
        let used = &self.calibration;
        DefinitionKey {
            calibration: (!used.assumed).then(|| used.id.clone()),
            revision: used.revision.clone(),
            width: self.image.width,
            height: self.image.height,
        }
    }

    /// Returns the persons as the tracker needs them, then those in the margin. A person without a
    /// direction is left out.
    pub(crate) fn observations(&self, definition: &CameraDefinition) -> Vec<Observation> {
        let persons = self.persons.iter().map(|person| (person, false));
        let margin = self.margin.iter().map(|person| (person, true));
        persons
            .chain(margin)
            .filter_map(|(person, is_in_margin)| observation(person, is_in_margin, definition))
            .collect()
    }
}

fn observation(
    person: &ReportPerson,
    is_in_margin: bool,
    definition: &CameraDefinition,
) -> Option<Observation> {
    let bearing = person.bearing?;
    let reported = &person.oriented_box;
    let center = Pixel::new(reported.cx, reported.cy);
    let angle = reported.angle_deg.to_radians();
    // The angle does not tell the head from the foot.
    let up = definition.up_at(center);
    let turned = OrientedBox::turned(center, reported.width, reported.height, angle);
    let along_axis = turned.with_head_toward(&up);
    let oriented = if person.lies() {
        along_axis.along(&up)
    } else {
        along_axis
    };
    let foot = oriented.foot();
    let camera = definition.geometry.as_ref();
    // A report has the middle of who lies. Here, a change of posture alone is not motion.
    let of_foot = camera.filter(|_| person.lies());
    let of_foot = of_foot.and_then(|it| floor_position(foot, &it.lens, &it.mount));
    let floor = person.floor.map(|floor| [floor.x_m, floor.y_m]);
    let signs = PostureSigns {
        angles: camera.and_then(|camera| BoxAngles::new(&oriented, &camera.lens, &camera.mount)),
        votes: person.floor_votes.map(|votes| FloorVotes {
            lying: votes.lying,
            low: votes.low,
        }),
    };
    Some(Observation {
        floor_m: of_foot.map_or(floor, |floor| Some([floor.x_m, floor.y_m])),
        azimuth_deg: bearing.azimuth_deg,
        off_axis_deg: bearing.off_axis_deg,
        center_px: [reported.cx, reported.cy],
        size_px: [oriented.width, oriented.height],
        signs,
        foot_px: [foot.x, foot.y],
        score: person.score,
        is_in_margin,
    })
}

fn is_plausible(ahead_ms: i64, is_on_site: bool) -> bool {
    let (behind, ahead) = if is_on_site {
        (MAX_BEHIND_ON_SITE_MS, MAX_AHEAD_ON_SITE_MS)
    } else {
        (MAX_BEHIND_MS, MAX_AHEAD_MS)
    };
    (-behind..=ahead).contains(&ahead_ms)
}

#[cfg(test)]
pub(crate) mod other_fields;

#[cfg(test)]
mod tests {
    use lookdown_calibration::{Areas, CameraGeometry};
    use lookdown_lens::geometry::{Lens, Mount};
    use nalgebra::Vector3;

    use super::{
        other_fields::{OF_PERSON, OF_REPORT},
        *,
    };

    fn report(captured_at: &str, person: &str) -> ReceivedReport {
        serde_json::from_str(&format!(
            r#"{{"camera": "hall", "received_at": "2026-11-22T10:00:00Z", "captured_at": {captured_at},
                 "calibration": {{"id": "hall", "revision": "1", "assumed": true}},
                 "image": {{"width": 200, "height": 200}}, "persons": [{person}], {OF_REPORT}}}"#
        ))
        .unwrap()
    }

    #[test]
    fn an_implausible_capture_time_is_replaced_by_the_arrival() {
        let received = report("null", "").at_ms(false);
        for (captured, alone, on_site) in [
            ("09:59:59.5Z", -500, -500),
            ("09:59:58.5Z", -1500, 0),
            ("10:00:00.4Z", 400, 400),
            ("10:00:04Z", 4000, 0),
            ("11:00:00Z", 0, 0),
            ("08:00:00Z", 0, 0),
        ] {
            let report = report(&format!("\"2026-11-22T{captured}\""), "");
            for (offset, is_on_site) in [(alone, false), (on_site, true)] {
                assert_eq!(report.at_ms(is_on_site) - received, offset, "{captured}");
                let is_used = report.clock_difference_ms(is_on_site).is_none();
                assert_eq!(is_used, offset != 0, "{captured}");
            }
        }
    }

    #[test]
    fn names_are_limited_as_those_of_the_server() {
        let report = report("null", "");
        assert!(report.has_valid_names());
        let change = |change: fn(&mut ReceivedReport)| {
            let mut changed = report.clone();
            changed.calibration.assumed = false;
            change(&mut changed);
            changed.has_valid_names()
        };
        assert!(change(|_| ()));
        assert!(!change(|report| report.camera = "n".repeat(129)));
        assert!(!change(|report| report.camera = String::new()));
        assert!(!change(|report| report.camera = "\u{202e}llah".to_owned()));
        assert!(!change(
            |report| report.calibration.id = "../results".to_owned()
        ));
        assert!(!change(
            |report| report.calibration.revision = "1".repeat(129)
        ));
    }

    #[test]
    fn a_change_of_posture_is_not_motion() {
        let definition = CameraDefinition {
            geometry: Some(CameraGeometry {
                lens: Lens::equidistant_circle(99.5, 99.5, 100.0, 1.57).unwrap(),
                mount: Mount::new(-Vector3::z_axis(), Some(3.0)),
                areas: Areas::default(),
            }),
            ..CameraDefinition::unknown()
        };
        // The report of someone who lies has the middle.
        let [seated, lying] = [("seated", 3.62), ("lying", 4.0)].map(|(posture, x_m)| {
            let person = format!(
                r#"{{{OF_PERSON}, "score": 0.8, "floor": {{"x_m": {x_m}, "y_m": 0}},
                    "bearing": {{"azimuth_deg": 0, "off_axis_deg": 40}}, "posture": "{posture}",
                    "floor_votes": {{"lying": 0.5, "low": 0.2}},
                    "oriented_box": {{"cx": 163, "cy": 100, "width": 12, "height": 14,
                                      "angle_deg": 90}}}}"#
            );
            report("null", &person).observations(&definition)[0]
                .floor_m
                .unwrap()
        });
        assert!((seated[0] - lying[0]).abs() < 0.01, "{seated:?} {lying:?}");
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
                r#"{{{OF_PERSON}, "score": 0.8, "floor": null, "bearing": {{"azimuth_deg": 0, "off_axis_deg": 40}},
                    "oriented_box": {{"cx": {cx}, "cy": 100, "width": 20, "height": 40,
                                      "angle_deg": {angle_deg}}}}}"#
            );
            let persons = report("null", &person).observations(&definition);
            assert!((persons[0].foot_px[0] - foot).abs() < 1e-9, "{persons:?}");
        }
    }
}

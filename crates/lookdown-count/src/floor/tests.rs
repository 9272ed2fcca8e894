use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use lookdown_calibration::CalibrationFile;

use crate::{
    counter::{Counter, CountingOptions},
    definition::CameraDefinition,
    metrics::Metrics,
    now::Now,
    report::{
        ReceivedReport,
        other_fields::{OF_PERSON, OF_REPORT},
    },
    snapshot::FloorAlert,
    sums::Totals,
};

/// Time of the first report, seconds since the Unix epoch.
const START_S: i64 = 1_795_262_400;

/// Center, width and height of the box of a person 2 m to the right of a camera at 3 m: standing,
/// and lying across the line of sight.
const STANDING: [f64; 3] = [751.0, 62.0, 129.0];
const LYING: [f64; 3] = [708.0, 158.0, 42.0];
/// The box of someone there who lies, kneels or sits.
const LOW: [f64; 3] = [710.0, 80.0, 70.0];

/// A camera with a zone at the person and a report each second.
struct Hall {
    counter: Counter,
    zone: &'static str,
    /// The votes of networks for people on the floor, as in reports.
    votes: &'static str,
    started: Instant,
    second: i64,
}

impl Hall {
    fn new(zone: &'static str) -> Self {
        let options = CountingOptions {
            longest_gap_ms: 10_000,
            max_cameras: 4,
            floor_alert_after_ms: Some(20_000),
            ..CountingOptions::default()
        };
        Self {
            counter: Counter::new(options, 0, Totals::default()),
            zone,
            votes: "null",
            started: Instant::now(),
            second: 0,
        }
    }

    /// Sends reports with this person for some seconds.
    fn watch(&mut self, seconds: i64, person: Option<[f64; 3]>) -> &mut Self {
        let votes = self.votes;
        for _ in 0..seconds {
            let person = person.map(|[cx, width, height]| {
                format!(
                    r#"{{{OF_PERSON}, "score": 0.9, "floor": {{"x_m": 2, "y_m": 0}}, "floor_votes": {votes},
                        "bearing": {{"azimuth_deg": 0, "off_axis_deg": 40}},
                        "oriented_box": {{"cx": {cx}, "cy": 500, "width": {width}, "height": {height},
                                          "angle_deg": 90}}}}"#
                )
            });
            let received = jiff::Timestamp::from_second(START_S + self.second).unwrap();
            let text = format!(
                r#"{{"camera": "hall", "received_at": "{received}",
                    "calibration": {{"id": "hall", "revision": "1", "assumed": false}},
                    "image": {{"width": 1000, "height": 1000}}, "persons": [{}], {OF_REPORT}}}"#,
                person.unwrap_or_default()
            );
            let report: ReceivedReport = serde_json::from_str(&text).unwrap();
            let definition = self.definition(&report);
            let now = Now {
                unix_ms: (START_S + self.second) * 1000,
                instant: self.started + Duration::from_secs(self.second.unsigned_abs()),
            };
            let event = now.unix_ms.unsigned_abs() * 1000;
            self.counter.accept(event, &report, &definition, now);
            self.second += 1;
        }
        self
    }

    fn definition(&self, report: &ReceivedReport) -> Arc<CameraDefinition> {
        let text = format!(
            r#"{{"id": "hall", "image": {{"width": 1000, "height": 1000}},
                "lens": {{"model": "equidistant", "focal": 318.3, "cx": 499.5, "cy": 499.5, "max_theta": 1.5708}},
                "mount": {{"world_up": [0, 0, -1], "height_m": 3}},
                "zones": [{{"name": "window", "frame_px": [[600, 400], [850, 400], [850, 600], [600, 600]]{}}}]}}"#,
            self.zone
        );
        let file = CalibrationFile::parse(text.as_bytes()).unwrap();
        let (_, calibration) = file.calibrations("hall", text.as_bytes()).remove(0);
        Arc::new(CameraDefinition::new(
            report.definition_key(),
            &calibration.unwrap(),
        ))
    }

    fn alerts(&self) -> Vec<FloorAlert> {
        let now_ms = (START_S + self.second) * 1000;
        let mut snapshot = self.counter.snapshot(now_ms);
        snapshot.cameras.remove(0).floor_alerts.unwrap()
    }

    fn metric(&self) -> String {
        let text = Metrics::new()
            .unwrap()
            .text(&self.counter, (START_S + self.second) * 1000);
        let text = String::from_utf8(text).unwrap();
        let mut lines = text
            .lines()
            .filter(|line| line.starts_with("lookdown_count_floor_alert{"));
        lines.next().unwrap().to_owned()
    }
}

#[test]
fn person_who_lies_is_an_alert_until_up_again() {
    let mut hall = Hall::new("");
    assert_eq!(hall.watch(10, Some(STANDING)).alerts(), []);
    assert_eq!(hall.watch(15, Some(LYING)).alerts(), []);
    let alerts = hall.watch(15, Some(LYING)).alerts();
    assert_eq!(
        (alerts[0].posture, alerts[0].zone.as_deref()),
        ("lying", Some("window"))
    );
    let since_s = alerts[0].since_ms / 1000 - START_S;
    assert!((10..=15).contains(&since_s), "{since_s}");
    assert!(hall.metric().ends_with(" 1"));
    // Detection may miss a person who lies.
    assert_eq!(hall.watch(600, None).alerts(), alerts);
    assert_eq!(hall.watch(10, Some(LYING)).alerts(), alerts);
    assert_eq!(hall.watch(20, Some(STANDING)).alerts(), []);
    assert!(hall.metric().ends_with(" 0"));
}

#[test]
fn acknowledged_alert_stays_listed() {
    let mut hall = Hall::new("");
    let id = hall
        .watch(10, Some(STANDING))
        .watch(40, Some(LYING))
        .alerts()[0]
        .id;
    assert_eq!(hall.counter.acknowledge("hall", id + 1), Some(false));
    assert_eq!(hall.counter.acknowledge("gate", id), None);
    assert_eq!(hall.counter.acknowledge("hall", id), Some(true));
    assert!(hall.alerts()[0].is_acknowledged);
    assert!(hall.metric().ends_with(" 0"));
    assert_eq!(hall.watch(300, None).alerts().len(), 1);
    assert_eq!(hall.watch(400, None).alerts(), []);
}

#[test]
fn person_who_may_lie_or_be_low_is_an_alert() {
    for (votes, count) in [
        (r#"{"lying": 0.55, "low": 0.5}"#, 1),
        (r#"{"lying": 0.05, "low": 0.5}"#, 0),
    ] {
        let mut hall = Hall::new("");
        hall.watch(5, Some(STANDING)).votes = votes;
        assert_eq!(hall.watch(60, Some(LOW)).alerts().len(), count, "{votes}");
    }
}

#[test]
fn person_who_is_seldom_down_is_no_alert() {
    for (other_s, count) in [(12, 0), (0, 1)] {
        let mut hall = Hall::new("");
        hall.watch(5, Some(STANDING));
        for _ in 0..6 {
            hall.votes = r#"{"lying": 0.6, "low": 0.4}"#;
            hall.watch(5, Some(LOW)).votes = r#"{"lying": 0.2, "low": 0.4}"#;
            hall.watch(other_s, Some(LOW));
        }
        assert_eq!(hall.alerts().len(), count, "{other_s} s in between");
    }
}

#[test]
fn what_lies_there_from_the_start_is_no_alert() {
    let mut hall = Hall::new("");
    assert_eq!(hall.watch(60, Some(LYING)).alerts(), []);
}

#[test]
fn person_lost_before_lying_down_is_an_alert() {
    let mut hall = Hall::new("");
    let [cx, width, height] = LYING;
    let fallen = [cx + 150.0, width, height];
    hall.watch(10, Some(STANDING)).watch(5, None);
    assert_eq!(hall.watch(60, Some(fallen)).alerts().len(), 1);
}

#[test]
fn person_who_sat_a_minute_has_not_come_down_in_the_same_box() {
    for (seated_s, count) in [(120, 0), (20, 1)] {
        let mut hall = Hall::new("");
        hall.votes = r#"{"lying": 0.05, "low": 0.25}"#;
        hall.watch(seated_s, Some(LOW));
        hall.votes = r#"{"lying": 0.55, "low": 0.5}"#;
        let [cx, width, height] = LOW;
        hall.watch(60, Some([cx + 5.0, width, height]));
        assert_eq!(hall.alerts().len(), count, "{seated_s} s");
    }
}

#[test]
fn person_who_lies_where_expected_is_no_alert() {
    let mut hall = Hall::new(r#", "lying": "expected""#);
    hall.watch(10, Some(STANDING)).watch(60, Some(LYING));
    assert_eq!(hall.alerts(), []);
}

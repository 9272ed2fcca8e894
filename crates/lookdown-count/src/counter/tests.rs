//! Places of cameras whose names clients choose.

use std::time::Instant;

use lookdown_calibration::CalibrationFile;

use super::*;
use crate::report::other_fields::OF_REPORT;

const START_MS: i64 = 1_795_262_400_000;

fn report(camera: &str, second: i64) -> ReceivedReport {
    let received = jiff::Timestamp::from_millisecond(START_MS + second * 1000).unwrap();
    let text = format!(
        r#"{{"camera": "{camera}", "received_at": "{received}",
            "calibration": {{"id": "assumed", "revision": "1", "assumed": true}},
            "image": {{"width": 200, "height": 200}}, "persons": [], {OF_REPORT}}}"#
    );
    serde_json::from_str(&text).unwrap()
}

fn calibrated() -> Arc<CameraDefinition> {
    let text = br#"{"id": "c", "image": {"width": 200, "height": 200},
        "lens": {"model": "equidistant", "focal": 63.7, "cx": 99.5, "cy": 99.5,
                 "max_theta": 1.5708}, "mount": {"world_up": [0, 0, -1]}}"#;
    let file = CalibrationFile::parse(text).unwrap();
    let (_, calibration) = file.calibrations("c", text).remove(0);
    let key = report("c", 0).definition_key();
    Arc::new(CameraDefinition::new(key, &calibration.unwrap()))
}

/// A counter with 4 places. `hall` is a camera of this process.
struct Places {
    counter: Counter,
    began: Instant,
}

impl Places {
    fn new() -> Self {
        let options = CountingOptions {
            longest_gap_ms: 10_000,
            max_cameras: 4,
            own: OwnCameras::default(),
        };
        options.own.set(["hall".to_owned()].into());
        Self {
            counter: Counter::new(options, 0, Totals::default()),
            began: Instant::now(),
        }
    }

    /// Returns true if the report of a camera at this second is counted.
    fn counts(&mut self, camera: &str, second: i64, definition: &Arc<CameraDefinition>) -> bool {
        let now = Now {
            unix_ms: START_MS + second * 1000,
            instant: self.began + Duration::from_secs(second.unsigned_abs()),
        };
        let event = now.unix_ms.unsigned_abs() * 1000 + self.counter.last_event() % 1000 + 1;
        let accepted = self
            .counter
            .accept(event, &report(camera, second), definition, now);
        matches!(accepted, Accepted::Counted(_))
    }
}

#[test]
fn own_camera_is_counted_after_many_names() {
    let unknown = Arc::new(CameraDefinition::unknown());
    let mut places = Places::new();
    for number in 0..300 {
        let counted = places.counts(&format!("x{number}"), 0, &unknown);
        assert_eq!(counted, number < 4, "{number}");
    }
    assert!(places.counts("hall", 1, &unknown));
    assert_eq!(places.counter.displaced_cameras(), 1);
    assert_eq!(places.counter.owners.len(), 4);
    // A new name is listed, as names of earlier ones are forgotten.
    assert!(!places.counts("new", 2, &unknown));
    let reason = places.counter.drops().reason("new").unwrap();
    assert!(reason.contains("raise counts.max_cameras"), "{reason}");
    assert!(places.counts("hall", 3, &unknown));
}

#[test]
fn camera_with_a_calibration_displaces_names() {
    let unknown = Arc::new(CameraDefinition::unknown());
    let mut places = Places::new();
    for number in 0..4 {
        assert!(places.counts(&format!("x{number}"), 0, &unknown));
    }
    assert!(places.counts("gate", 0, &calibrated()));
    for number in 0..100 {
        places.counts(&format!("y{number}"), 20 + number, &unknown);
    }
    assert!(places.counter.scene_of("gate").is_some());
}

#[test]
fn silent_name_makes_room_for_another() {
    let unknown = Arc::new(CameraDefinition::unknown());
    let mut places = Places::new();
    for number in 0..4 {
        places.counts(&format!("x{number}"), 0, &unknown);
    }
    assert!(!places.counts("new", 10, &unknown));
    assert!(places.counts("new", 11, &unknown));
}

//! Places of cameras whose names clients choose.

use std::time::Instant;

use lookdown_calibration::CalibrationFile;

use super::*;
use crate::{metrics::Metrics, report::other_fields::OF_REPORT};

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
                 "max_theta": 1.5708}, "mount": {"world_up": [0, 0, -1]},
        "lines": [{"name": "door", "frame_px": [[50, 50], [150, 150]],
                   "directions": ["in", "out"]}]}"#;
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
            ..CountingOptions::default()
        };
        options.own.set([("hall".to_owned(), false)].into());
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
        let event = now.unix_ms.unsigned_abs() * 1000 + self.counter.last_event % 1000 + 1;
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
    assert_eq!(places.counter.displaced_cameras, 1);
    assert_eq!(places.counter.owners.len(), 4);
    // A new name is listed, as names of earlier ones are forgotten.
    assert!(!places.counts("new", 2, &unknown));
    let reason = places.counter.drops.reason("new").unwrap();
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
fn slow_frames_are_marked_for_cameras_with_lines() {
    let mut places = Places::new();
    let unknown = Arc::new(CameraDefinition::unknown());
    for second in 0..60 {
        places.counts("gate", second, &calibrated());
        places.counts("hall", second, &unknown);
    }
    let snapshot = places.counter.snapshot(START_MS + 60_000);
    let [gate, hall] = &snapshot.cameras[..] else {
        panic!("{snapshot:?}")
    };
    let since_ms = gate.too_low_since_ms.unwrap() - START_MS;
    assert!((1_000..10_000).contains(&since_ms), "{since_ms}");
    assert_eq!(hall.too_low_since_ms, None);
    let slow: u64 = places.counter.sums.slow.values().sum();
    assert_eq!(slow, 59_000 - since_ms.unsigned_abs());
    let warning = places.counter.warning("gate").unwrap();
    assert!(warning.contains("1.0 frames/s become reports"), "{warning}");
    assert_eq!(places.counter.warning("hall"), None);
}

#[test]
fn paused_camera_has_no_present_number() {
    let mut places = Places::new();
    places.counts("hall", 0, &calibrated());
    for is_paused in [false, true] {
        let own = &places.counter.options.own;
        own.set([("hall".to_owned(), is_paused)].into());
        let hall = &places.counter.snapshot(START_MS).cameras[0];
        assert_eq!(hall.persons, (!is_paused).then_some(0));
        let metrics = Metrics::new().unwrap().text(&places.counter, START_MS);
        let metrics = String::from_utf8(metrics).unwrap();
        let shown = metrics.contains("lookdown_count_last_report_timestamp_seconds{");
        assert_eq!(shown, !is_paused, "{metrics}");
        assert_eq!(
            metrics.contains("lookdown_count_too_low{camera=\"hall\"} 0"),
            !is_paused
        );
    }
}

#[test]
fn removed_camera_leaves_the_current_counts() {
    let mut places = Places::new();
    for camera in ["hall", "gate"] {
        places.counts(camera, 0, &calibrated());
    }
    assert!(places.counter.remove("hall", true));
    assert_eq!(places.counter.snapshot(START_MS).cameras.len(), 1);
    let presence = |counter: &Counter| counter.sums.presence.len();
    assert_eq!(presence(&places.counter), 2, "the history is kept");
    assert!(!places.counter.remove("hall", false));
    assert_eq!(presence(&places.counter), 1);
    let batch = places.counter.take_batch().unwrap();
    let gone = batch.scenes.iter().filter(|(_, state)| state.is_none());
    assert_eq!(gone.count(), 1);
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

#[test]
fn bar_is_that_of_the_server_widened_to_the_number() {
    let mut counter = Counter::new(CountingOptions::default(), 0, Totals::default());
    assert_eq!(counter.bar("hall", 3), [1, 5]);
    counter.set_bars([("hall".to_owned(), [4, 6])].into());
    assert_eq!(counter.bar("hall", 5), [4, 6]);
    assert_eq!(counter.bar("hall", 3), [3, 6]);
}

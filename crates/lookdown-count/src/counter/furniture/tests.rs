use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use lookdown_calibration::CalibrationFile;
use lookdown_tracking::furniture::{Furniture, ThingState};

use crate::{
    counter::{Counter, CountingOptions},
    definition::CameraDefinition,
    now::Now,
    report::{
        ReceivedReport,
        other_fields::{OF_PERSON, OF_REPORT},
    },
    store::Store,
    sums::Totals,
};

/// Time of the first report, seconds since the Unix epoch.
const START_S: i64 = 1_795_262_400;

fn options() -> CountingOptions {
    CountingOptions {
        longest_gap_ms: 10_000,
        max_cameras: 4,
        ..CountingOptions::default()
    }
}

/// A counter whose camera `hall` has a mannequin in each report, one a second.
struct Hall {
    counter: Counter,
    definition: Arc<CameraDefinition>,
    started: Instant,
    second: i64,
}

/// The definition of the camera: `mount` has further members.
fn definition(report: &ReceivedReport, mount: &str) -> Arc<CameraDefinition> {
    let text = format!(
        r#"{{"id": "hall", "image": {{"width": 1000, "height": 1000}},
            "lens": {{"model": "equidistant", "focal": 318.3, "cx": 499.5, "cy": 499.5,
                      "max_theta": 1.5708}},
            "mount": {{"world_up": [0, 0, -1], "height_m": 3{mount}}}}}"#
    );
    let file = CalibrationFile::parse(text.as_bytes()).unwrap();
    let (_, calibration) = file.calibrations("hall", text.as_bytes()).remove(0);
    let key = report.definition_key();
    Arc::new(CameraDefinition::new(key, &calibration.unwrap()))
}

fn report(second: i64, revision: u8) -> ReceivedReport {
    let received = jiff::Timestamp::from_second(START_S + second).unwrap();
    let text = format!(
        r#"{{"camera": "hall", "received_at": "{received}",
            "calibration": {{"id": "hall", "revision": "{revision}", "assumed": false}},
            "image": {{"width": 1000, "height": 1000}},
            "persons": [{{{OF_PERSON}, "score": 0.97, "floor": {{"x_m": 2, "y_m": 1}},
                "bearing": {{"azimuth_deg": 26.6, "off_axis_deg": 36.7}},
                "oriented_box": {{"cx": 680, "cy": 590, "width": 40, "height": 80,
                                  "angle_deg": 63.4}}}}],
            {OF_REPORT}}}"#
    );
    serde_json::from_str(&text).unwrap()
}

impl Hall {
    fn new() -> Self {
        Self {
            counter: Counter::new(options(), 0, Totals::default()),
            definition: definition(&report(0, 1), ""),
            started: Instant::now(),
            second: 0,
        }
    }

    /// Follows the camera for some seconds. `clock` is the time between two reports by the clock of
    /// the machine.
    fn follow(&mut self, seconds: i64, clock: Duration) {
        for _ in 0..seconds {
            let report = report(self.second, 1);
            let event = (START_S + self.second).unsigned_abs() * 1_000_000;
            let now = Now {
                unix_ms: (START_S + self.second) * 1000,
                instant: self.started,
            };
            self.counter.accept(event, &report, &self.definition, now);
            self.started += clock;
            self.second += 1;
        }
    }

    fn persons(&self) -> Option<u64> {
        let snapshot = self.counter.snapshot((START_S + self.second) * 1000);
        snapshot.cameras[0].persons
    }

    fn states(&self) -> Vec<ThingState> {
        let furniture = self.counter.furniture("hall");
        let things = furniture.into_iter().flat_map(Furniture::things);
        things.map(|thing| thing.state).collect()
    }

    /// A hall with a mannequin that is furniture.
    fn with_furniture() -> Self {
        let mut hall = Self::new();
        hall.follow(7300, Duration::from_secs(1));
        assert_eq!(hall.states(), [ThingState::Remembered]);
        hall
    }
}

#[test]
fn furniture_is_not_counted() {
    let mut hall = Hall::new();
    hall.follow(7000, Duration::from_secs(1));
    assert_eq!(hall.persons(), Some(1));
    hall.follow(300, Duration::from_secs(1));
    assert_eq!(
        (hall.states(), hall.persons()),
        (vec![ThingState::Remembered], Some(0))
    );
}

#[test]
fn a_camera_clock_that_runs_fast_hastens_no_furniture() {
    let mut hall = Hall::new();
    hall.follow(14_000, Duration::from_millis(500));
    assert_eq!(hall.states(), [ThingState::Candidate]);
}

#[test]
fn furniture_and_decisions_survive_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("counts.sqlite");
    let mut hall = Hall::with_furniture();
    assert_eq!(
        hall.counter.change_furniture("hall", |all| all.confirm(1)),
        Some(true)
    );
    assert!(hall.counter.is_urgent);
    let batch = hall.counter.take_batch().unwrap();
    Store::open(&path)
        .unwrap()
        .commit(&batch, &[], None)
        .unwrap();
    let resumed = Store::open(&path).unwrap().resumed().unwrap();
    hall.counter = Counter::new(options(), resumed.last_event, resumed.totals);
    for scene in resumed.scenes {
        hall.counter.resume(scene, |_| Arc::clone(&hall.definition));
    }
    hall.follow(10, Duration::from_secs(1));
    assert_eq!(
        (hall.states(), hall.persons()),
        (vec![ThingState::Confirmed], Some(0))
    );
}

#[test]
fn furniture_taken_back_counts_again() {
    let mut hall = Hall::with_furniture();
    assert_eq!(
        hall.counter
            .change_furniture("hall", |all| all.take_back(9)),
        Some(false)
    );
    assert_eq!(
        hall.counter
            .change_furniture("hall", |all| all.take_back(1)),
        Some(true)
    );
    assert_eq!(
        hall.counter
            .change_furniture("attic", |all| all.take_back(1)),
        None
    );
    hall.follow(10, Duration::from_secs(1));
    assert_eq!((hall.states(), hall.persons()), (vec![], Some(1)));
}

#[test]
fn furniture_is_forgotten_with_frames_of_another_size() {
    for mount in ["", r#", "site": "ground", "position_m": [4, 2]"#] {
        let mut hall = Hall::with_furniture();
        let mut larger = report(0, 1);
        larger.image.width = 2000;
        larger.image.height = 2000;
        hall.definition = definition(&larger, mount);
        hall.follow(10, Duration::from_secs(1));
        // Its track may go on, and then it is a candidate.
        let is_remembered = hall.states().contains(&ThingState::Remembered);
        assert_eq!((is_remembered, hall.persons()), (false, Some(1)), "{mount}");
    }
}

#[test]
fn furniture_stays_when_the_camera_joins_a_site() {
    let mut hall = Hall::with_furniture();
    for mount in [r#", "site": "ground", "position_m": [4, 2]"#, ""] {
        hall.definition = definition(&report(0, 2), mount);
        hall.follow(10, Duration::from_secs(1));
        assert_eq!(
            (hall.states(), hall.persons()),
            (vec![ThingState::Remembered], Some(0))
        );
    }
}

use std::{
    sync::LazyLock,
    time::{Duration, Instant},
};

use lookdown_calibration::CalibrationFile;
use lookdown_lens::geometry::PostureSigns;

use super::*;

static START: LazyLock<Instant> = LazyLock::new(Instant::now);

/// A surely seen person at a place of the floor, 3 m below the camera.
fn person(x: f64, y: f64) -> Observation {
    let px = [500.0 + 100.0 * x, 500.0 + 100.0 * y];
    Observation {
        floor_m: Some([x, y]),
        azimuth_deg: y.atan2(x).to_degrees() + 90.0,
        off_axis_deg: x.hypot(y).atan2(3.0).to_degrees(),
        center_px: px,
        size_px: [40.0, 80.0],
        signs: PostureSigns::default(),
        foot_px: px,
        score: 0.95,
        is_in_margin: false,
    }
}

/// A camera whose area ends at the line "door", x = 0.
const CALIBRATION: &str = r#"{
    "id": "hall", "image": {"width": 1000, "height": 1000},
    "lens": {"model": "equidistant", "focal": 318.3, "cx": 499.5, "cy": 499.5, "max_theta": 1.5708},
    "mount": {"world_up": [0, 0, -1], "height_m": 3},
    "areas": [{"floor_m": [[0, -3], [4, -3], [4, 3], [0, 3]]}],
    "zones": [{"name": "all", "floor_m": [[-4, -3], [4, -3], [4, 3], [-4, 3]]}],
    "lines": [{"name": "door", "floor_m": [[0, 3], [0, -3]]}]
}"#;

fn scene() -> Scene {
    let file = CalibrationFile::parse(CALIBRATION.as_bytes()).unwrap();
    let (_, calibration) = file.calibrations("hall", CALIBRATION.as_bytes()).remove(0);
    let key = DefinitionKey {
        calibration: Some("hall".to_owned()),
        revision: "1".to_owned(),
        width: 1000,
        height: 1000,
    };
    let definition = Arc::new(CameraDefinition::new(key, &calibration.unwrap()));
    let owner = Owner::Camera("hall".to_owned());
    Scene::new(owner, vec![("hall".to_owned(), definition)]).unwrap()
}

/// The time of a report that arrives at once.
fn time(at_ms: i64) -> ReportTime {
    ReportTime {
        at_ms,
        longest_gap_ms: 10_000,
        floor_alert_after_ms: None,
        bar: None,
        now: *START + Duration::from_millis(at_ms.unsigned_abs()),
    }
}

#[test]
fn door_at_the_edge_of_an_area_loses_no_crossing() {
    let (mut scene, mut sums) = (scene(), Sums::default());
    let (mut crossings, mut persons) = (0, Vec::new());
    for frame in 0..30_i32 {
        // At 5 reports per second: from the margin, 0.9 m outside, to 2.6 m inside, and back.
        let walked = 0.24 * f64::from(frame);
        let x = if walked < 3.5 {
            walked - 0.9
        } else {
            6.1 - walked
        };
        let seen = Observation {
            is_in_margin: x < 0.0,
            ..person(x, 0.5)
        };
        let at_ms = 200 * i64::from(frame);
        let found = scene.accept(0, time(at_ms), &[seen], &mut sums);
        crossings += found.unwrap().len();
        let zone = scene.cameras[0]
            .occupancy()
            .map(|(_, persons)| persons)
            .sum::<usize>();
        persons.push((x >= 0.0, scene.presence().persons, zone));
    }
    assert_eq!(crossings, 2);
    for &(is_inside, persons, _) in &persons[6..] {
        assert_eq!(persons, u64::from(is_inside));
    }
    let most_in_zone = persons.iter().map(|&(_, _, zone)| zone).max();
    assert_eq!(most_in_zone, Some(1));
    assert_eq!(persons.last().map(|&(_, _, zone)| zone), Some(0));
}

use lookdown_count::{FloorAlert, LineSnapshot, ZoneSnapshot};

use super::*;

fn snapshot(crossings: u64, persons: Option<u64>) -> Snapshot {
    Snapshot {
        cameras: vec![CameraSnapshot {
            name: "hall".to_owned(),
            last_report_ms: 1_000,
            is_paused: false,
            too_low_since_ms: None,
            floor_alerts: None,
            persons,
            bar: None,
            lines: vec![LineSnapshot {
                line: "door".to_owned(),
                direction: "in".to_owned(),
                crossings,
            }],
            zones: vec![ZoneSnapshot {
                zone: "till".to_owned(),
                persons,
                entries: 0,
                person_ms: 0,
            }],
        }],
        sites: Vec::new(),
    }
}

#[test]
fn each_new_crossing_is_an_event() {
    let found = events(&snapshot(12, Some(1)), &snapshot(14, Some(1)));
    let body = json!({
        "event_type": "crossing", "camera": "hall", "timestamp": "1970-01-01T00:00:01Z",
        "line": "door", "direction": "in",
    });
    assert_eq!(found.len(), 2);
    assert!(found.iter().all(|event| event.body == body), "{found:?}");
    // The totals of the store are not events.
    assert!(events(&Snapshot::default(), &snapshot(14, Some(1))).is_empty());
    assert_eq!(
        events(&snapshot(0, None), &snapshot(u64::MAX, None)).len(),
        MAX_EVENTS
    );
}

#[test]
fn the_first_person_after_none_is_an_event() {
    let found = events(&snapshot(0, Some(0)), &snapshot(0, Some(2)));
    let zones: Vec<_> = found.iter().map(|event| &event.body["zone"]).collect();
    assert_eq!(zones, [&Value::Null, &json!("till")]);
    assert_eq!(found[0].body["event_type"], "occupancy.reached");
    for (before, now) in [(Some(1), Some(2)), (None, Some(2)), (Some(0), None)] {
        assert!(events(&snapshot(0, before), &snapshot(0, now)).is_empty());
    }
}

#[test]
fn new_floor_alert_is_an_event() {
    let lying = |ids: std::ops::RangeInclusive<u64>| {
        let alert = |id| FloorAlert {
            id,
            posture: "lying",
            since_ms: 500,
            zone: Some("till".to_owned()),
            is_acknowledged: false,
        };
        let mut snapshot = snapshot(0, Some(1));
        snapshot.cameras[0].floor_alerts = Some(ids.map(alert).collect());
        snapshot
    };
    let found = events(&lying(1..=1), &lying(1..=2));
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].body["event_type"], "floor_alert");
    assert_eq!(found[0].body["since"], "1970-01-01T00:00:00.5Z");
    assert!(events(&lying(1..=2), &lying(1..=1)).is_empty());
    // No other event replaces its image, or uses up the limit of images.
    let topics = Topics::new("lookdown", None);
    let base = "lookdown/counts";
    assert_eq!(
        found[0].image_topics(&topics),
        [
            format!("{base}/event_images/hall"),
            format!("{base}/floor_alert_images/hall")
        ]
    );
    let entered = events(&snapshot(0, Some(0)), &snapshot(0, Some(1)));
    let only = [format!("{base}/event_images/hall")];
    assert_eq!(entered[0].image_topics(&topics), only);
}

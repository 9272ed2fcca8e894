use lookdown_count::{CameraSnapshot, LineSnapshot, SiteSnapshot, ZoneSnapshot};

use super::*;

fn publisher() -> CountsPublisher {
    let options = CountsOptions {
        broker: "mqtt://127.0.0.1".parse().unwrap(),
        authorities: None,
        topic_prefix: "lookdown".to_owned(),
        discovery_prefix: Some("homeassistant".to_owned()),
    };
    let (_, snapshots) = watch::channel(Snapshot::default());
    CountsPublisher::new(options, snapshots).unwrap()
}

fn snapshot(persons: Option<u64>) -> Snapshot {
    Snapshot {
        cameras: vec![CameraSnapshot {
            name: "hall".to_owned(),
            last_report_ms: 0,
            persons,
            lines: vec![LineSnapshot {
                line: "door".to_owned(),
                direction: "in".to_owned(),
                crossings: 12,
            }],
            zones: vec![ZoneSnapshot {
                zone: "till".to_owned(),
                persons,
                entries: 7,
                person_ms: 61_500,
            }],
        }],
        sites: vec![SiteSnapshot {
            name: "ground".to_owned(),
            persons,
        }],
    }
}

#[test]
fn totals_and_occupancy_are_published() {
    let retained = publisher().retained(&snapshot(Some(3)));
    let base = "lookdown/counts/cameras/hall";
    for (topic, payload) in [
        (format!("{base}/availability"), "online"),
        (format!("{base}/persons"), "3"),
        (format!("{base}/lines/door/in"), "12"),
        (format!("{base}/zones/till/persons"), "3"),
        (format!("{base}/zones/till/entries"), "7"),
        (format!("{base}/zones/till/dwell_seconds"), "61"),
        ("lookdown/counts/sites/ground/persons".to_owned(), "3"),
    ] {
        assert_eq!(
            retained.get(&topic).map(String::as_str),
            Some(payload),
            "{topic}"
        );
    }
    let config = &retained["homeassistant/sensor/lookdown_hall_count_line_door_in/config"];
    let config: Value = serde_json::from_str(config).unwrap();
    assert_eq!(config["state_class"], "total_increasing");
    assert_eq!(
        config["state_topic"],
        "lookdown/counts/cameras/hall/lines/door/in"
    );
    assert_eq!(config["device"]["identifiers"][0], "lookdown_hall");
}

#[test]
fn unknown_occupancy_is_removed_and_totals_stay() {
    let publisher = publisher();
    let known = publisher.retained(&snapshot(Some(3)));
    let unknown = publisher.retained(&snapshot(None));
    let messages = changes(&known, &unknown);
    let topics: Vec<_> = messages
        .iter()
        .map(|message| message.topic.as_str())
        .collect();
    let base = "lookdown/counts/cameras/hall";
    assert!(
        topics.contains(&format!("{base}/persons").as_str()),
        "{topics:?}"
    );
    assert!(!topics.contains(&format!("{base}/lines/door/in").as_str()));
    assert!(changes(&known, &known).is_empty());
}

use lookdown_common::ServerOptions;
use lookdown_count::{CameraSnapshot, FloorAlert, LineSnapshot, SiteSnapshot, ZoneSnapshot};

use super::*;

fn publisher() -> CountsPublisher {
    let options = CountsOptions {
        broker: "mqtt://127.0.0.1".parse().unwrap(),
        authorities: None,
        topic_prefix: "lookdown".to_owned(),
        discovery_prefix: Some("homeassistant".to_owned()),
        unknown_for: Duration::from_secs(10),
        image_every: Some(Duration::from_secs(1)),
    };
    let (_, snapshots) = watch::channel(Snapshot::default());
    let server = ServerOptions {
        url: "http://127.0.0.1:1".parse().unwrap(),
        api_key: None,
        authorities: None,
        in_process: None,
    };
    let server = ServerClient::new(&server).unwrap();
    CountsPublisher::new(options, snapshots, server).unwrap()
}

fn snapshot(persons: Option<u64>) -> Snapshot {
    Snapshot {
        cameras: vec![CameraSnapshot {
            name: "hall".to_owned(),
            last_report_ms: 0,
            is_paused: false,
            persons,
            bar: persons.map(|persons| [persons, persons + 1]),
            too_low_since_ms: Some(60_000),
            floor_alerts: Some(vec![FloorAlert {
                id: 1,
                posture: "lying",
                since_ms: 90_000,
                zone: None,
                is_acknowledged: false,
            }]),
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
        (
            format!("{base}/attributes"),
            concat!(
                r#"{"floor_alerts":[{"is_acknowledged":false,"posture":"lying","#,
                r#""since":"1970-01-01T00:01:30Z","zone":null}],"#,
                r#""persons_high":4,"persons_low":3,"too_low_since":"1970-01-01T00:01:00Z"}"#
            ),
        ),
        (format!("{base}/floor_alert"), "ON"),
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
    let config = &retained["homeassistant/binary_sensor/lookdown_hall_count_floor_alert/config"];
    let config: Value = serde_json::from_str(config).unwrap();
    assert_eq!(config["device_class"], "safety");
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

/// A message of the broker.
fn received(topic: &str, payload: &str, is_retained: bool) -> Publish {
    let mut publish = Publish::new(topic, rumqttc::QoS::AtMostOnce, payload);
    publish.retain = is_retained;
    publish
}

#[test]
fn unknown_retained_topics_are_withdrawn() {
    let publisher = publisher();
    let before = publisher.retained(&snapshot(Some(3)));
    let mut unknown = RetainedTopics::default();
    let nothing = Retained::new();
    let mut answers = Vec::new();
    for (topic, payload) in before
        .iter()
        .filter(|(topic, _)| !topic.contains("/config"))
    {
        let message = received(topic, payload, true);
        answers.extend(publisher.compare(&message, &nothing, &mut unknown));
    }
    // What has no messages now is unavailable at once, and gone later, with its entities.
    let unavailable: Vec<_> = answers.iter().map(|answer| answer.topic.as_str()).collect();
    assert_eq!(
        unavailable,
        [
            "lookdown/counts/cameras/hall/availability",
            "lookdown/counts/sites/ground/availability"
        ]
    );
    assert!(answers.iter().all(|answer| answer.payload == OFFLINE));
    let withdrawn = publisher.withdrawals(&mut unknown, &nothing);
    let withdrawn: std::collections::BTreeSet<_> =
        withdrawn.into_iter().map(|message| message.topic).collect();
    assert_eq!(withdrawn, before.into_keys().collect());
    assert!(publisher.withdrawals(&mut unknown, &nothing).is_empty());
}

#[test]
fn only_the_removed_line_of_a_known_camera_is_withdrawn() {
    let publisher = publisher();
    let before = publisher.retained(&snapshot(Some(3)));
    let mut changed = snapshot(Some(3));
    changed.cameras[0].lines.clear();
    let own = publisher.retained(&changed);
    let mut unknown = RetainedTopics::default();
    for (topic, payload) in &before {
        let message = received(topic, payload, true);
        assert_eq!(
            publisher.compare(&message, &own, &mut unknown),
            None,
            "{topic}"
        );
    }
    let withdrawn = publisher.withdrawals(&mut unknown, &own);
    let withdrawn: Vec<_> = withdrawn.into_iter().map(|message| message.topic).collect();
    assert_eq!(
        withdrawn,
        [
            "lookdown/counts/cameras/hall/lines/door/in",
            "homeassistant/sensor/lookdown_hall_count_line_door_in/config"
        ]
    );
}

#[test]
fn topics_of_another_companion_stay() {
    let publisher = publisher();
    let (nothing, own) = (Retained::new(), publisher.retained(&snapshot(Some(3))));
    let mut unknown = RetainedTopics::default();
    let topic = "lookdown/counts/cameras/gate/persons";
    let retained = received(topic, "1", true);
    assert!(
        publisher
            .compare(&retained, &nothing, &mut unknown)
            .is_some()
    );
    // The echo of the message above, and then a message of the other companion.
    let availability = "lookdown/counts/cameras/gate/availability";
    let echo = received(availability, OFFLINE, false);
    assert_eq!(publisher.compare(&echo, &nothing, &mut unknown), None);
    let live = received(topic, "2", false);
    assert_eq!(publisher.compare(&live, &nothing, &mut unknown), None);
    assert!(publisher.withdrawals(&mut unknown, &nothing).is_empty());
    // Another companion makes a camera of this one unavailable.
    let other = received("lookdown/counts/cameras/hall/availability", OFFLINE, false);
    let answer = publisher.compare(&other, &own, &mut unknown).unwrap();
    assert_eq!(answer.payload, ONLINE);
    let foreign = received("lookdown/cameras/hall/persons", "3", true);
    assert_eq!(publisher.compare(&foreign, &own, &mut unknown), None);
}

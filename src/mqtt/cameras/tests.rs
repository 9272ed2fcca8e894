use jiff::Timestamp;

use super::*;
use crate::results::{NewReport, ReportId};

fn cameras(most: usize) -> Cameras {
    let topics = Topics::new("lookdown", Some("homeassistant"));
    Cameras::new(topics, NonZeroUsize::new(most).unwrap())
}

fn report(camera: &str, persons: usize, zones: &str) -> StoredReport {
    StoredReport {
        id: ReportId::default(),
        report: NewReport {
            camera: camera.to_owned(),
            received_at: Timestamp::UNIX_EPOCH,
            persons,
            json: format!("{{\"camera\":\"{camera}\"{zones}}}").into(),
        },
    }
}

/// Topic and payload of all messages that are no announcements, and the number of announcements.
fn published(messages: &[Message]) -> (Vec<(String, String)>, usize) {
    let is_announcement = |message: &&Message| message.topic.starts_with("homeassistant/");
    let published = messages.iter().filter(|message| !is_announcement(message));
    let text = |message: &Message| String::from_utf8(message.payload.to_vec()).unwrap();
    let published = published.map(|message| (message.topic.clone(), text(message)));
    (
        published.collect(),
        messages.iter().filter(is_announcement).count(),
    )
}

#[test]
fn the_first_report_announces_a_camera_and_each_updates_it() {
    let mut cameras = cameras(10);
    let messages = cameras.hear(&report("lobby", 2, ""));
    let expected = [
        ("lookdown/cameras/lobby/persons", "2"),
        ("lookdown/cameras/lobby/report", "{\"camera\":\"lobby\"}"),
    ];
    let expected = expected.map(|(topic, text)| (topic.to_owned(), text.to_owned()));
    assert_eq!(published(&messages), (expected.to_vec(), 2));
    let kept: Vec<_> = messages.iter().map(|message| message.retained).collect();
    assert_eq!(kept, [true, true, true, false]);

    let (published, announcements) = published(&cameras.hear(&report("lobby", 0, "")));
    assert_eq!((published[0].1.as_str(), announcements), ("0", 0));
}

#[test]
fn zones_come_and_go_with_the_calibration() {
    let mut cameras = cameras(10);
    let zones = ",\"zones\":[{\"name\":\"door\",\"persons\":1},{\"name\":\"till\",\"persons\":0}]";
    let (first, announcements) = published(&cameras.hear(&report("lobby", 1, zones)));
    assert_eq!(announcements, 4);
    assert_eq!(
        first[1],
        ("lookdown/cameras/lobby/zones/door".into(), "1".into())
    );
    assert_eq!(
        first[2],
        ("lookdown/cameras/lobby/zones/till".into(), "0".into())
    );

    let messages = cameras.hear(&report(
        "lobby",
        1,
        ",\"zones\":[{\"name\":\"till\",\"persons\":1}]",
    ));
    let door = Message::forget("lookdown/cameras/lobby/zones/door".to_owned());
    assert!(messages.contains(&door), "{messages:?}");
    let config = "homeassistant/sensor/lookdown_lobby_zone_door/config";
    assert!(
        messages.contains(&Message::forget(config.to_owned())),
        "{messages:?}"
    );
    assert_eq!(published(&messages).1, 1 + 3);
}

#[test]
fn retained_messages_are_repeated_without_reports() {
    let mut cameras = cameras(10);
    cameras.hear(&report("lobby", 1, ""));
    cameras.hear(&report("gate", 3, ""));
    cameras.hear(&report("lobby", 2, ""));
    let messages = cameras.all();
    assert!(messages.iter().all(|message| message.retained));
    let expected = [
        ("lookdown/cameras/gate/persons", "3"),
        ("lookdown/cameras/lobby/persons", "2"),
    ];
    let expected = expected.map(|(topic, text)| (topic.to_owned(), text.to_owned()));
    assert_eq!(published(&messages), (expected.to_vec(), 4));
}

#[test]
fn only_the_first_cameras_up_to_the_limit_are_published() {
    let mut cameras = cameras(2);
    for camera in ["a", "b", "c"] {
        let published = !cameras.hear(&report(camera, 1, "")).is_empty();
        assert_eq!(published, camera != "c", "{camera}");
    }
    assert!(!cameras.hear(&report("a", 2, "")).is_empty());
    assert_eq!(published(&cameras.all()).0.len(), 2);
}

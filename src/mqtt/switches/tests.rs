use bytes::Bytes;
use rumqttc::QoS;

use super::*;
use crate::cameras::tests::{camera, cameras, hold};

const HALL: &str = "lookdown/cameras/hall/detection";
const UNKNOWN_FOR: Duration = Duration::from_mins(10);

fn switches(folder: &std::path::Path) -> Switches {
    let cameras = cameras(folder);
    if cameras.stored().unwrap().is_empty() {
        let hall = camera("rtsp://10.0.0.8/");
        cameras.put("hall", hall, None).unwrap();
    }
    let topics = Topics::new("lookdown", Some("homeassistant"));
    Switches::new(topics, Discovery::default(), Arc::new(cameras))
}

fn message(topic: &str, payload: &'static str, retain: bool) -> Publish {
    let payload = Bytes::from_static(payload.as_bytes());
    let mut message = Publish::from_bytes(topic, QoS::AtMostOnce, payload);
    message.retain = retain;
    message
}

fn state(payload: &'static str) -> Message {
    Message::retained(HALL.to_owned(), payload)
}

#[tokio::test]
async fn a_command_pauses_a_camera_also_after_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let command = format!("{HALL}/set");
    let now = Instant::now();
    let mut before = switches(folder.path());
    before.begin_connection(now, UNKNOWN_FOR);
    let [announcement, on] = before.update(now).await.try_into().unwrap();
    assert!(announcement.topic.starts_with("homeassistant/switch/"));
    assert_eq!(on, state("ON"));
    assert!(before.update(now).await.is_empty());
    for (payload, retain) in [("OFF", true), ("maybe", false)] {
        assert!(before.note(&message(&command, payload, retain)));
        assert!(before.update(now).await.is_empty(), "{payload}");
    }
    before.note(&message(&command, "OFF", false));
    assert_eq!(before.update(now).await, [state("OFF")]);

    let mut after = switches(folder.path());
    after.begin_connection(now, UNKNOWN_FOR);
    assert_eq!(after.update(now).await.last(), Some(&state("OFF")));
    after.note(&message(&command, "ON", false));
    assert_eq!(after.update(now).await, [state("ON")]);

    // A command that arrives before the cameras are known waits for them.
    let mut early = switches(folder.path());
    early.begin_connection(now, UNKNOWN_FOR);
    early.note(&message(&command, "OFF", false));
    assert_eq!(early.update(now).await.last(), Some(&state("OFF")));
    assert!(early.update(now).await.is_empty());
}

#[tokio::test]
async fn a_switch_that_no_server_publishes_is_withdrawn() {
    let folder = tempfile::tempdir().unwrap();
    let mut switches = switches(folder.path());
    let now = Instant::now();
    switches.begin_connection(now, UNKNOWN_FOR);
    switches.update(now).await;
    for camera in ["hall", "gone", "elsewhere"] {
        let topic = format!("lookdown/cameras/{camera}/detection");
        assert!(switches.note(&message(&topic, "ON", true)));
    }
    // Another server publishes it.
    switches.note(&message(
        "lookdown/cameras/elsewhere/detection",
        "OFF",
        false,
    ));
    assert!(switches.update(now).await.is_empty());
    let withdrawn = switches.update(now + UNKNOWN_FOR).await;
    let topics: Vec<_> = withdrawn
        .iter()
        .map(|message| message.topic.as_str())
        .collect();
    let expected = [
        "lookdown/cameras/gone/detection",
        "homeassistant/switch/lookdown_gone_detection/config",
    ];
    assert_eq!(topics, expected);
    assert!(withdrawn.iter().all(|message| message.payload.is_empty()));
}

#[tokio::test]
async fn files_that_hang_delay_no_reports() {
    let folder = tempfile::tempdir().unwrap();
    let mut switches = switches(folder.path());
    let now = Instant::now();
    switches.begin_connection(now, UNKNOWN_FOR);
    switches.update(now).await;
    let cameras = Arc::clone(&switches.cameras);
    let hanging = hold(&cameras);
    let command = format!("{HALL}/set");
    switches.note(&message(&command, "OFF", false));
    for limit in [Duration::from_secs(20), FILES_TIMEOUT / 2] {
        let changes = timeout(limit, switches.update(now)).await;
        assert!(changes.unwrap().is_empty());
    }
    // The latest command counts, also one that arrives while the files hang.
    switches.note(&message(&command, "ON", false));
    drop(hanging);
    let mut published = Vec::new();
    let all = async {
        while published.len() < 2 {
            published.extend(switches.update(now).await);
            tokio::task::yield_now().await;
        }
    };
    timeout(Duration::from_secs(20), all).await.unwrap();
    assert_eq!(published, [state("OFF"), state("ON")]);
}

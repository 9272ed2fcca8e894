use std::collections::BTreeSet;

use jiff::Timestamp;
use lookdown_imaging::decode::DecodeLimits;

use super::*;
use crate::{
    results::{ImagesOf, NewReport, ReportId},
    views::{View, Views},
};

const HOLD: Duration = Duration::from_secs(5);
const EXPIRY: Duration = Duration::from_mins(10);
const NO_ATTRIBUTES: &str =
    r#"{"calibration":null,"model":null,"persons_high":4,"persons_low":0,"profile":null}"#;

fn topics() -> Topics {
    Topics::new("lookdown", Some("homeassistant"))
}

fn cameras(most: usize) -> Cameras {
    let discovery = Discovery {
        expire_after: Some(EXPIRY),
        ..Discovery::default()
    };
    cameras_with(discovery, most)
}

fn cameras_with(discovery: Discovery, most: usize) -> Cameras {
    let most = NonZeroUsize::new(most).unwrap();
    let own = OwnCameras::default();
    own.set([("own".to_owned(), false)].into());
    Cameras::new(topics(), discovery, HOLD, most, own)
}

fn report(camera: &str, persons: usize, zones: &str) -> StoredReport {
    StoredReport {
        id: ReportId::default(),
        report: NewReport {
            camera: camera.to_owned(),
            received_at: Timestamp::UNIX_EPOCH,
            persons,
            scores: None,
            json: format!("{{\"camera\":\"{camera}\"{zones}}}").into(),
        },
    }
}

fn update(cameras: &mut Cameras, report: &StoredReport) -> Vec<Message> {
    cameras.update(
        report,
        NumberWithBar::untaught(report.report.persons),
        Duration::ZERO,
        Instant::now(),
    )
}

/// Topic and payload of all messages that are not announcements, and the number of announcements.
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

fn expected(messages: &[(&str, &str)]) -> Vec<(String, String)> {
    let topic = |topic: &str| format!("lookdown/cameras/{topic}");
    let messages = messages.iter();
    messages
        .map(|(name, payload)| (topic(name), (*payload).to_owned()))
        .collect()
}

#[test]
fn paused_camera_is_unavailable_at_once() {
    let mut cameras = cameras(10);
    update(&mut cameras, &report("own", 7, ""));
    assert!(cameras.pause(Instant::now()).is_empty());
    cameras.own.set([("own".to_owned(), true)].into());
    let (messages, _) = published(&cameras.pause(Instant::now()));
    assert_eq!(messages, expected(&[("own/availability", "offline")]));
    assert!(cameras.pause(Instant::now()).is_empty());
}

#[test]
fn the_first_report_announces_a_camera_and_each_updates_it() {
    let mut cameras = cameras(10);
    let messages = update(&mut cameras, &report("lobby", 2, ""));
    let wanted = expected(&[
        ("lobby/attributes", NO_ATTRIBUTES),
        ("lobby/persons", "2"),
        ("lobby/frame_persons", "2"),
        ("lobby/occupancy", "ON"),
        ("lobby/availability", "online"),
        ("lobby/report", "{\"camera\":\"lobby\"}"),
    ]);
    assert_eq!(published(&messages), (wanted, 3));
    let kept: Vec<_> = messages.iter().map(|message| message.retained).collect();
    assert_eq!(
        kept,
        [true, true, true, true, true, true, true, true, false]
    );

    let (published, announcements) = published(&update(&mut cameras, &report("lobby", 0, "")));
    let (bar, persons) = (&published[0].1, &published[1].1);
    assert!(bar.contains("\"persons_high\":1"), "{bar}");
    assert_eq!((persons.as_str(), announcements), ("0", 0));
}

#[test]
fn zones_come_and_go_with_the_calibration() {
    let mut cameras = cameras(10);
    let zones = ",\"zones\":[{\"name\":\"door\",\"persons\":1},{\"name\":\"till\",\"persons\":0}]";
    let (first, announcements) = published(&update(&mut cameras, &report("lobby", 1, zones)));
    assert_eq!(announcements, 7);
    let wanted = expected(&[
        ("lobby/zones/door", "1"),
        ("lobby/zones/door/occupancy", "ON"),
        ("lobby/zones/till", "0"),
        ("lobby/zones/till/occupancy", "OFF"),
    ]);
    assert_eq!(first[4..8], wanted);

    let zones = ",\"zones\":[{\"name\":\"till\",\"persons\":1}]";
    let messages = update(&mut cameras, &report("lobby", 1, zones));
    let removed = messages.iter().filter(|message| message.payload.is_empty());
    let removed: BTreeSet<_> = removed.map(|message| message.topic.as_str()).collect();
    let wanted = [
        "homeassistant/binary_sensor/lookdown_lobby_zone_door_occupancy/config",
        "homeassistant/sensor/lookdown_lobby_zone_door/config",
        "lookdown/cameras/lobby/zones/door",
        "lookdown/cameras/lobby/zones/door/occupancy",
    ];
    assert_eq!(removed, BTreeSet::from(wanted));
    assert_eq!(published(&messages).1, 2 + 5);
}

#[test]
fn retained_messages_are_repeated_without_reports() {
    let mut cameras = cameras(10);
    update(&mut cameras, &report("lobby", 1, ""));
    update(&mut cameras, &report("gate", 3, ""));
    update(&mut cameras, &report("lobby", 2, ""));
    let messages = cameras.all(Instant::now());
    assert!(messages.iter().all(|message| message.retained));
    let (published, announcements) = published(&messages);
    assert_eq!((published.len(), announcements), (10, 6));
    assert_eq!(published[1], expected(&[("gate/persons", "3")])[0]);
    assert_eq!(published[6], expected(&[("lobby/persons", "2")])[0]);
}

#[test]
fn attributes_are_published_when_they_change() {
    let mut cameras = cameras(10);
    let mut attributes = |profile: &str| {
        let parts = format!(
            ",\"request_id\":\"{profile}\",\"calibration\":{{\"id\":\"hall\",\"revision\":\"a\"}},\
             \"model\":{{\"name\":\"yolox\"}},\"profile\":\"{profile}\""
        );
        let (published, announcements) =
            published(&update(&mut cameras, &report("lobby", 1, &parts)));
        let mut found = published.into_iter();
        let found = found.find(|(topic, _)| topic.ends_with("/attributes"));
        (found.map(|(_, payload)| payload), announcements)
    };
    let fast = r#"{"calibration":"hall","model":"yolox","persons_high":2,"persons_low":0,"profile":"fast"}"#;
    assert_eq!(attributes("fast"), (Some(fast.to_owned()), 3));
    assert_eq!(attributes("fast"), (None, 0));
    let careful = fast.replace("fast", "careful");
    assert_eq!(attributes("careful"), (Some(careful), 0));
}

#[test]
fn only_the_first_cameras_up_to_the_limit_are_published() {
    let mut cameras = cameras(2);
    for camera in ["a", "b", "c"] {
        let published = !update(&mut cameras, &report(camera, 1, "")).is_empty();
        assert_eq!(published, camera != "c", "{camera}");
    }
    assert!(!update(&mut cameras, &report("a", 2, "")).is_empty());
    assert_eq!(published(&cameras.all(Instant::now())).0.len(), 10);
}

#[test]
fn occupancy_ends_after_the_hold_availability_at_expiry() {
    let (mut cameras, begin) = (cameras(10), Instant::now());
    cameras.update(
        &report("lobby", 1, ""),
        NumberWithBar::untaught(1),
        Duration::ZERO,
        begin,
    );
    assert_eq!(cameras.next_change(), Some(begin + EXPIRY));
    let messages = cameras.update(
        &report("lobby", 0, ""),
        NumberWithBar::untaught(0),
        Duration::ZERO,
        begin,
    );
    assert_eq!(published(&messages).0[3].1, "ON");
    assert_eq!(cameras.next_change(), Some(begin + HOLD));
    assert!(cameras.expire(begin).is_empty());
    let messages = published(&cameras.expire(begin + HOLD)).0;
    assert_eq!(messages, expected(&[("lobby/occupancy", "OFF")]));
    let messages = published(&cameras.expire(begin + EXPIRY)).0;
    assert_eq!(messages, expected(&[("lobby/availability", "offline")]));
    assert_eq!(cameras.next_change(), None);
    let messages = update(&mut cameras, &report("lobby", 0, ""));
    assert_eq!(published(&messages).0[3].1, "online");
    let messages = cameras.update(
        &report("gate", 0, ""),
        NumberWithBar::untaught(0),
        EXPIRY,
        begin,
    );
    assert_eq!(published(&messages).0[4].1, "offline");
}

#[test]
fn removed_cameras_are_withdrawn() {
    let discovery = Discovery {
        images: ImagesOf::All,
        ..Discovery::default()
    };
    let mut cameras = cameras_with(discovery, 10);
    let zones = ",\"zones\":[{\"name\":\"door\",\"persons\":1}]";
    let announced = update(&mut cameras, &report("lobby", 1, zones));
    update(&mut cameras, &report("gate", 1, ""));
    let removed = cameras.retain(&["gate".to_owned()]);
    let topics = |messages: &[Message]| {
        let kept = messages.iter().filter(|message| message.retained);
        kept.map(|message| message.topic.clone())
            .collect::<BTreeSet<_>>()
    };
    assert_eq!(topics(&removed), topics(&announced));
    assert!(removed.iter().all(|message| message.payload.is_empty()));
    assert!(cameras.retain(&["gate".to_owned()]).is_empty());
}

#[test]
fn views_of_cameras_with_images_are_published_and_withdrawn() {
    let discovery = Discovery {
        images: ImagesOf::Some(["lobby".to_owned()].into()),
        ..Discovery::default()
    };
    let (mut cameras, begin) = (cameras_with(discovery, 10), Instant::now());
    let folder = tempfile::tempdir().unwrap();
    let views = Views::new(folder.path().to_owned(), DecodeLimits::default(), None);
    for camera in ["lobby", "gate"] {
        update(&mut cameras, &report(camera, 1, ""));
        views.put(camera, "door", View::default()).unwrap();
    }
    let config = "homeassistant/camera/lookdown_lobby_view_door/config";
    let (topic, values) = (
        "lookdown/cameras/lobby/views/door",
        r#"{"kind":"fixed","azimuth_deg":0.0,"width":960,"height":720}"#,
    );
    let messages = cameras.update_views(&views);
    assert!(messages.iter().all(|message| message.retained));
    assert!(messages.iter().any(|message| message.topic == config));
    assert_eq!(
        published(&messages).0,
        [(topic.to_owned(), values.to_owned())]
    );
    assert!(cameras.update_views(&views).is_empty());
    let all = cameras.all(begin);
    assert!(all.iter().any(|message| message.topic == topic));
    // A view that another process has deleted.
    cameras.begin_connection(begin);
    let retained = |camera: &str, view: &str| topics().view(camera, view);
    for (camera, view) in [("lobby", "gone"), ("lobby", "door"), ("old", "door")] {
        cameras.compare(&retained(camera, view), b"{}", true);
    }
    let removed = cameras.expire(begin + EXPIRY);
    let removed: Vec<_> = removed.iter().map(|message| &*message.topic).collect();
    for (view, is_gone) in [
        ("lobby/views/gone", true),
        ("lobby/views/door", false),
        ("old/views/door", true),
    ] {
        let topic = format!("lookdown/cameras/{view}");
        assert_eq!(removed.contains(&&*topic), is_gone, "{topic}");
    }
    views.delete("lobby", "door").unwrap();
    let gone = cameras.update_views(&views);
    for topic in [topic, config] {
        assert!(
            gone.contains(&Message::forget(topic.to_owned())),
            "{gone:?}"
        );
    }
}

#[test]
fn unknown_retained_cameras_are_withdrawn_after_a_time() {
    let (mut cameras, begin, topics) = (cameras(10), Instant::now(), topics());
    update(&mut cameras, &report("lobby", 1, ""));
    cameras.begin_connection(begin);
    let mut retained = |topic: &str| cameras.compare(topic, b"1", true);
    let offline = |camera: &str| {
        let topic = topics.of_camera(camera, "availability");
        Some(Message::retained(topic, "offline"))
    };
    assert_eq!(
        retained(&topics.of_camera("old", "persons")),
        offline("old")
    );
    assert_eq!(retained(&topics.zone("old", "door")), None);
    assert_eq!(
        retained(&topics.of_camera("other", "availability")),
        offline("other")
    );
    assert_eq!(retained(&topics.of_camera("lobby", "persons")), None);
    assert_eq!(retained(&topics.zone("lobby", "gone")), None);
    assert_eq!(retained("lookdown/status"), None);
    // The messages of this server and of another one come back as they are published.
    assert_eq!(
        cameras.compare(&topics.of_camera("old", "availability"), b"offline", false),
        None
    );
    assert_eq!(
        cameras.compare(&topics.of_camera("other", "persons"), b"3", false),
        None
    );
    let online = Message::retained(topics.of_camera("lobby", "availability"), "online");
    let answer = cameras.compare(
        &topics.of_camera("lobby", "availability"),
        b"offline",
        false,
    );
    assert_eq!(answer, Some(online));

    let removed = cameras.expire(begin + EXPIRY);
    let removed = removed.iter().filter(|message| message.payload.is_empty());
    let removed: BTreeSet<_> = removed.map(|message| message.topic.as_str()).collect();
    let wanted = [
        "homeassistant/binary_sensor/lookdown_lobby_zone_gone_occupancy/config",
        "homeassistant/binary_sensor/lookdown_old_occupancy/config",
        "homeassistant/binary_sensor/lookdown_old_zone_door_occupancy/config",
        "homeassistant/image/lookdown_old_image/config",
        "homeassistant/sensor/lookdown_lobby_zone_gone/config",
        "homeassistant/sensor/lookdown_old_frame_persons/config",
        "homeassistant/sensor/lookdown_old_persons/config",
        "homeassistant/sensor/lookdown_old_zone_door/config",
        "lookdown/cameras/lobby/zones/gone",
        "lookdown/cameras/lobby/zones/gone/occupancy",
        "lookdown/cameras/old/attributes",
        "lookdown/cameras/old/availability",
        "lookdown/cameras/old/frame_persons",
        "lookdown/cameras/old/occupancy",
        "lookdown/cameras/old/persons",
        "lookdown/cameras/old/zones/door",
        "lookdown/cameras/old/zones/door/occupancy",
    ];
    assert_eq!(removed, BTreeSet::from(wanted));
    // Later, retained messages are ignored.
    assert_eq!(
        cameras.compare(&topics.of_camera("late", "persons"), b"1", true),
        None
    );
}

#[test]
fn headline_number_is_published_beside_that_of_the_frame() {
    let (mut cameras, now) = (cameras(10), Instant::now());
    let messages = cameras.update(
        &report("lobby", 9, ""),
        NumberWithBar::untaught(5),
        Duration::ZERO,
        now,
    );
    let published_now = published(&messages).0;
    for expected in expected(&[("lobby/persons", "5"), ("lobby/frame_persons", "9")]) {
        assert!(published_now.contains(&expected), "{published_now:?}");
    }
    assert_eq!(cameras.available(), ["lobby"]);
    assert!(
        cameras
            .set_number("lobby", NumberWithBar::untaught(5), now)
            .is_empty()
    );
    let followed = published(&cameras.set_number("lobby", NumberWithBar::untaught(6), now)).0;
    assert_eq!(followed[0], expected(&[("lobby/persons", "6")])[0]);
    assert!(
        cameras
            .set_number("unknown", NumberWithBar::untaught(6), now)
            .is_empty()
    );
}

#[test]
fn own_camera_is_published_beyond_the_limit() {
    let mut cameras = cameras(1);
    assert!(!update(&mut cameras, &report("x", 1, "")).is_empty());
    assert!(update(&mut cameras, &report("y", 1, "")).is_empty());
    let messages = update(&mut cameras, &report("own", 2, ""));
    let forgotten = messages
        .iter()
        .any(|message| message.topic.ends_with("/x/persons") && message.payload.is_empty());
    assert!(forgotten, "{messages:?}");
    assert_eq!(cameras.available(), ["own"]);
}

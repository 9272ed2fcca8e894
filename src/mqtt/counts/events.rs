//! Events of the counts: crossings, the first person after none, and floor alerts. They follow from
//! two successive snapshots, so that only stored crossings are published.
//!
//! The entities of the events of a camera in Home Assistant, and their topics.

use std::{collections::HashMap, time::Duration};

use jiff::Timestamp;
use lookdown_common::ServerClient;
use lookdown_count::{CameraSnapshot, FloorAlert, Snapshot, latest_image};
use serde_json::{Value, json};
use tokio::{sync::mpsc, time::Instant};

use crate::mqtt::{
    discovery::{Device, EVENT, IMAGE},
    topics::{Topics, level},
};

/// The type of a crossing of a line.
const CROSSING: &str = "crossing";
/// The type of the first person after none.
const OCCUPANCY_REACHED: &str = "occupancy.reached";
/// The type of a person who has been on the floor for a while.
const FLOOR_ALERT: &str = "floor_alert";
/// All types.
pub(super) const TYPES: [&str; 3] = [CROSSING, OCCUPANCY_REACHED, FLOOR_ALERT];
/// Most events of two snapshots, which are a second apart.
const MAX_EVENTS: usize = 100;

/// An event of a camera.
#[derive(Debug, PartialEq)]
pub(super) struct Event {
    pub(super) camera: String,
    /// JSON, with the type in `event_type`.
    pub(super) body: Value,
}

impl Event {
    /// Returns the topics of the image at the event. Those of floor alerts have one of their own,
    /// which no other event replaces.
    fn image_topics(&self, topics: &Topics) -> Vec<String> {
        let is_alert = self.body["event_type"] == FLOOR_ALERT;
        let images = IMAGES.iter().take(1 + usize::from(is_alert));
        let topics = images.map(|&(.., folder)| image_topic(topics, folder, &self.camera));
        topics.collect()
    }
}

/// Returns the events between two snapshots. A camera that the first one does not have has none.
pub(super) fn events(before: &Snapshot, now: &Snapshot) -> Vec<Event> {
    let mut events = Vec::new();
    for camera in &now.cameras {
        let earlier = before.cameras.iter().find(|it| it.name == camera.name);
        if let Some(earlier) = earlier {
            crossings(earlier, camera, &mut events);
            occupancy(earlier, camera, &mut events);
            floor_alerts(earlier, camera, &mut events);
        }
    }
    events.truncate(MAX_EVENTS);
    events
}

fn crossings(before: &CameraSnapshot, now: &CameraSnapshot, events: &mut Vec<Event>) {
    for line in &now.lines {
        let same = |it: &&_| {
            let it: &lookdown_count::LineSnapshot = it;
            (&it.line, &it.direction) == (&line.line, &line.direction)
        };
        let Some(earlier) = before.lines.iter().find(same) else {
            continue;
        };
        let new = line.crossings.saturating_sub(earlier.crossings);
        let new = usize::try_from(new).unwrap_or(MAX_EVENTS).min(MAX_EVENTS);
        let parts = json!({ "line": line.line, "direction": line.direction });
        events.extend((0..new).map(|_| event(now, CROSSING, &parts)));
    }
}

fn occupancy(before: &CameraSnapshot, now: &CameraSnapshot, events: &mut Vec<Event>) {
    let is_reached = |before: Option<u64>, now: Option<u64>| {
        before == Some(0) && now.is_some_and(|persons| persons > 0)
    };
    if is_reached(before.persons, now.persons) {
        let parts = json!({ "zone": null, "persons": now.persons });
        events.push(event(now, OCCUPANCY_REACHED, &parts));
    }
    for zone in &now.zones {
        let earlier = before.zones.iter().find(|it| it.zone == zone.zone);
        if earlier.is_some_and(|earlier| is_reached(earlier.persons, zone.persons)) {
            let parts = json!({ "zone": zone.zone, "persons": zone.persons });
            events.push(event(now, OCCUPANCY_REACHED, &parts));
        }
    }
}

/// Returns a floor alert as attributes and events have it.
pub(super) fn floor_alert(alert: &FloorAlert) -> Value {
    let since = Timestamp::from_millisecond(alert.since_ms).ok();
    json!({
        "posture": alert.posture, "since": since.map(|time| time.to_string()), "zone": alert.zone,
        "is_acknowledged": alert.is_acknowledged,
    })
}

fn floor_alerts(before: &CameraSnapshot, now: &CameraSnapshot, events: &mut Vec<Event>) {
    let earlier: Vec<u64> = before
        .floor_alerts
        .iter()
        .flatten()
        .map(|alert| alert.id)
        .collect();
    let alerts = now.floor_alerts.iter().flatten();
    let new = alerts.filter(|alert| !earlier.contains(&alert.id));
    events.extend(new.map(|alert| event(now, FLOOR_ALERT, &floor_alert(alert))));
}

fn event(camera: &CameraSnapshot, kind: &str, parts: &Value) -> Event {
    let mut body = parts.clone();
    let time = Timestamp::from_millisecond(camera.last_report_ms);
    body["event_type"] = json!(kind);
    body["camera"] = json!(camera.name);
    body["timestamp"] = time.map_or(Value::Null, |time| json!(time.to_string()));
    Event {
        camera: camera.name.clone(),
        body,
    }
}

/// An image of a camera at an event.
pub(super) struct EventImage {
    /// The topics of the image.
    pub(super) topics: Vec<String>,
    pub(super) jpeg: Vec<u8>,
}

/// Requests an image for each event that is received, one at a time and one per camera and kind of
/// image in `every`, until the sender or the receiver is gone.
pub(super) async fn request_images(
    client: ServerClient,
    topics: Topics,
    every: Duration,
    mut events: mpsc::Receiver<Event>,
    to: mpsc::Sender<EventImage>,
) {
    let mut last = HashMap::<Vec<String>, Instant>::new();
    while let Some(event) = events.recv().await {
        let topics = event.image_topics(&topics);
        last.retain(|_, at| at.elapsed() < every);
        if last.contains_key(&topics) {
            continue;
        }
        last.insert(topics.clone(), Instant::now());
        if let Some(jpeg) = latest_image(&client, &event.camera).await
            && to.send(EventImage { topics, jpeg }).await.is_err()
        {
            return;
        }
    }
}

/// The ID of the entity of events.
const EVENT_ID: &str = "count_event";
/// The entities of images, those of all events first: ID, name, and the level of the topics above
/// the camera. It is not `cameras`, so that no image comes back to its publisher.
const IMAGES: [(&str, &str, &str); 2] = [
    ("count_event_image", "Latest event", "event_images"),
    (
        "count_floor_alert_image",
        "Latest floor alert",
        "floor_alert_images",
    ),
];

fn image_topic(topics: &Topics, folder: &str, camera: &str) -> String {
    topics.counts(&format!("{folder}/{}", level(camera)))
}

/// The topic of the events of a camera.
pub(super) fn event_topic(topics: &Topics, camera: &str) -> String {
    topics.counts(&format!("events/{}", level(camera)))
}

/// Returns the topics and payloads that announce the events of a camera, and their images.
pub(super) fn announcements(
    topics: &Topics,
    device: &Device<'_>,
    has_images: bool,
) -> impl Iterator<Item = (String, String)> {
    let camera = device.name;
    let event = json!({
        "name": "Event",
        "state_topic": event_topic(topics, camera),
        "event_types": TYPES,
    });
    let shown = if has_images { &IMAGES[..] } else { &[] };
    let images = shown.iter().map(|&(id, name, folder)| {
        let topic = image_topic(topics, folder, camera);
        let config = json!({ "name": name, "image_topic": topic, "content_type": "image/jpeg" });
        (IMAGE, id, config)
    });
    let entities = [(EVENT, EVENT_ID, event)].into_iter().chain(images);
    entities.filter_map(|(component, id, config)| {
        device.announcement(topics, component, id, [topics.counts("status")], config)
    })
}

/// Returns the topics of these announcements.
pub(super) fn config_topics(topics: &Topics, device: &Device<'_>) -> impl Iterator<Item = String> {
    let images = IMAGES.iter().map(|&(id, ..)| (IMAGE, id));
    [(EVENT, EVENT_ID)]
        .into_iter()
        .chain(images)
        .filter_map(|(component, id)| topics.config(component, &device.entity_id(id)))
}

#[cfg(test)]
mod tests;

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
    pub(super) camera: String,
    pub(super) jpeg: Vec<u8>,
}

/// Requests an image for each camera that is received, one at a time and one per camera in `every`,
/// until the sender or the receiver is gone.
pub(super) async fn request_images(
    client: ServerClient,
    every: Duration,
    mut cameras: mpsc::Receiver<String>,
    to: mpsc::Sender<EventImage>,
) {
    let mut last = HashMap::<String, Instant>::new();
    while let Some(camera) = cameras.recv().await {
        last.retain(|_, at| at.elapsed() < every);
        if last.contains_key(&camera) {
            continue;
        }
        last.insert(camera.clone(), Instant::now());
        if let Some(jpeg) = latest_image(&client, &camera).await
            && to.send(EventImage { camera, jpeg }).await.is_err()
        {
            return;
        }
    }
}

/// The IDs of the entities.
const EVENT_ID: &str = "count_event";
const IMAGE_ID: &str = "count_event_image";

/// The topic of the events of a camera.
pub(super) fn event_topic(topics: &Topics, camera: &str) -> String {
    topics.counts(&format!("events/{}", level(camera)))
}

/// The topic of the images of the events of a camera. It is not below `cameras`, so that no image
/// comes back to its publisher.
pub(super) fn image_topic(topics: &Topics, camera: &str) -> String {
    topics.counts(&format!("event_images/{}", level(camera)))
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
    let image = json!({
        "name": "Latest event",
        "image_topic": image_topic(topics, camera),
        "content_type": "image/jpeg",
    });
    let image = has_images.then_some((IMAGE, IMAGE_ID, image));
    let entities = [(EVENT, EVENT_ID, event)].into_iter().chain(image);
    entities.filter_map(|(component, id, config)| {
        device.announcement(topics, component, id, [topics.counts("status")], config)
    })
}

/// Returns the topics of these announcements.
pub(super) fn config_topics(topics: &Topics, device: &Device<'_>) -> impl Iterator<Item = String> {
    [(EVENT, EVENT_ID), (IMAGE, IMAGE_ID)]
        .into_iter()
        .filter_map(|(component, id)| topics.config(component, &device.entity_id(id)))
}

#[cfg(test)]
mod tests;

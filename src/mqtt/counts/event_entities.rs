//! The entities of the events of a camera in Home Assistant, and their topics.

use serde_json::json;

use super::events::TYPES;
use crate::mqtt::{
    discovery::{Device, EVENT, IMAGE},
    topics::{Topics, level},
};

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

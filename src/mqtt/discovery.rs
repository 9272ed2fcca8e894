//! Announces a camera's entities to Home Assistant (its documentation: MQTT, section "MQTT
//! discovery"): occupancy and the number of persons, of the camera and of each zone, its views, and
//! the fields that all entities have in common.
//!
//! The retained topics that this client does not publish, such as those of a camera that was
//! removed while no server was connected. They are withdrawn some time after the connection, unless
//! another client publishes them.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use serde_json::{Value, json};
use url::Url;

use super::{
    occupancy::{OFF, ON},
    session::Message,
    topics::{Topics, level},
};
use crate::results::ImagesOf;

/// The status while the server is connected or a camera sends frames, and the one when it is not.
pub(super) const ONLINE: &str = "online";
pub(super) const OFFLINE: &str = "offline";
/// The ID of the number of the latest frame.
const FRAME_PERSONS: &str = "frame_persons";
/// The ID of the switch for detection.
const DETECTION: &str = "detection";

/// The parts of the announcements that the settings give.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Discovery {
    /// Time without a report after which a sensor is unavailable.
    pub expire_after: Option<Duration>,
    /// The address of the server's web page, shown with each device.
    pub configuration_url: Option<Url>,
    /// The address at which users of this installation get help.
    pub support_url: Option<Url>,
    /// The cameras whose images are published.
    pub images: ImagesOf,
}

/// An entity: component, ID within the device, and configuration.
type Entity = (&'static str, String, Value);

impl Discovery {
    /// The announcements of a camera, its zones and its views. Empty without a discovery prefix.
    pub(super) fn announcements<'a>(
        &self,
        topics: &Topics,
        camera: &str,
        zones: impl IntoIterator<Item = &'a str>,
        views: impl IntoIterator<Item = &'a str>,
    ) -> Vec<Message> {
        let of_camera = [
            occupancy("Occupancy", None, &topics.of_camera(camera, "occupancy")),
            persons("Persons", None, &topics.of_camera(camera, "persons")),
            frame_persons(&topics.of_camera(camera, "frame_persons")),
        ];
        let zones = zones.into_iter().flat_map(|zone| {
            let name = |what: &str| format!("{what} in {zone}");
            let state = topics.zone(camera, zone);
            let occupied = topics.zone_occupancy(camera, zone);
            [
                persons(&name("Persons"), Some(zone), &state),
                occupancy(&name("Occupancy"), Some(zone), &occupied),
            ]
        });
        let device = device(topics, camera);
        let image = self.images.include(camera).then(|| image(topics, camera));
        let views = views.into_iter().map(|name| view(topics, camera, name));
        let all = of_camera.into_iter().chain(image).chain(zones);
        all.chain(views)
            .filter_map(|(component, entity, config)| {
                let availability = [topics.status(), topics.of_camera(camera, "availability")];
                let mut config = self.completed(config, topics, camera);
                // Images have no such field.
                let is_image = [IMAGE, CAMERA].contains(&component);
                if let Some(expire_after) = self.expire_after.filter(|_| !is_image) {
                    config["expire_after"] = json!(expire_after.as_secs());
                }
                device.announcement(topics, component, &entity, availability, config)
            })
            .map(|(topic, payload)| Message::retained(topic, payload))
            .collect()
    }

    /// The announcement of a camera's switch for detection, which is available while the server is.
    /// `None` without a discovery prefix.
    pub(super) fn switch(&self, topics: &Topics, camera: &str) -> Option<Message> {
        let config = json!({
            "name": "Detection",
            "state_topic": topics.of_camera(camera, "detection"),
            "command_topic": topics.detection_command(camera),
            "payload_on": ON,
            "payload_off": OFF,
            "icon": "mdi:account-search",
        });
        let config = self.completed(config, topics, camera);
        let (device, status) = (device(topics, camera), [topics.status()]);
        let announcement = device.announcement(topics, SWITCH, DETECTION, status, config);
        announcement.map(|(topic, payload)| Message::retained(topic, payload))
    }

    /// The message that removes the switch of a camera from Home Assistant.
    pub(super) fn switch_withdrawal(topics: &Topics, camera: &str) -> Option<Message> {
        let id = device(topics, camera).entity_id(DETECTION);
        topics.config(SWITCH, &id).map(Message::forget)
    }

    /// Adds the fields that all entities of a camera have in common.
    fn completed(&self, mut config: Value, topics: &Topics, camera: &str) -> Value {
        config["json_attributes_topic"] = json!(topics.of_camera(camera, "attributes"));
        config["device"]["model"] = json!("Ceiling fisheye camera");
        if let Some(url) = &self.configuration_url {
            config["device"]["configuration_url"] = json!(url.as_str());
        }
        if let Some(url) = &self.support_url {
            config["origin"]["support_url"] = json!(url.as_str());
        }
        config
    }
}

fn device<'a>(topics: &Topics, camera: &'a str) -> Device<'a> {
    Device {
        id: topics.device_id(camera),
        name: camera,
    }
}

/// The messages that remove the entities of a camera, or of one of its zones, from Home Assistant.
pub(super) fn config_withdrawals(
    topics: &Topics,
    camera: &str,
    zone: Option<&str>,
) -> Vec<Message> {
    let of_camera = [(SENSOR, FRAME_PERSONS), (IMAGE, IMAGE)];
    let of_camera = of_camera.map(|(component, id)| (component, id.to_owned()));
    let of_camera = zone.is_none().then_some(of_camera);
    let entities = [occupancy_id(zone), persons_id(zone)];
    let device = device(topics, camera);
    let topics = entities
        .into_iter()
        .chain(of_camera.into_iter().flatten())
        .filter_map(|(component, entity)| topics.config(component, &device.entity_id(&entity)));
    topics.map(Message::forget).collect()
}

/// The message that removes the entity of a view from Home Assistant.
pub(super) fn view_withdrawal(topics: &Topics, camera: &str, view: &str) -> Option<Message> {
    let id = device(topics, camera).entity_id(&view_id(view));
    topics.config(CAMERA, &id).map(Message::forget)
}

fn occupancy(name: &str, zone: Option<&str>, state_topic: &str) -> Entity {
    let config = json!({
        "name": name,
        "state_topic": state_topic,
        "device_class": "occupancy",
        "payload_on": ON,
        "payload_off": OFF,
    });
    let (component, id) = occupancy_id(zone);
    (component, id, config)
}

fn persons(name: &str, zone: Option<&str>, state_topic: &str) -> Entity {
    let config = json!({
        "name": name,
        "state_topic": state_topic,
        "state_class": "measurement",
        "icon": "mdi:account-group",
    });
    let (component, id) = persons_id(zone);
    (component, id, config)
}

/// The number of the latest frame, for diagnosis: Home Assistant shows it once a user enables it.
fn frame_persons(state_topic: &str) -> Entity {
    let config = json!({
        "name": "Persons in the latest frame",
        "state_topic": state_topic,
        "state_class": "measurement",
        "icon": "mdi:account-multiple-outline",
        "entity_category": "diagnostic",
        "enabled_by_default": false,
    });
    (SENSOR, FRAME_PERSONS.to_owned(), config)
}

fn image(topics: &Topics, camera: &str) -> Entity {
    let config = json!({
        "name": "Latest image",
        "image_topic": topics.of_camera(camera, "image"),
        "content_type": "image/jpeg",
    });
    (IMAGE, IMAGE.to_owned(), config)
}

/// A straight view, as a camera.
fn view(topics: &Topics, camera: &str, name: &str) -> Entity {
    let config = json!({
        "name": format!("View {name}"),
        "topic": topics.view_image(camera, name),
    });
    (CAMERA, view_id(name), config)
}

fn view_id(view: &str) -> String {
    format!("view_{}", level(view))
}

fn occupancy_id(zone: Option<&str>) -> (&'static str, String) {
    let id = zone.map_or("occupancy".to_owned(), |zone| {
        format!("zone_{}_occupancy", level(zone))
    });
    (BINARY_SENSOR, id)
}

fn persons_id(zone: Option<&str>) -> (&'static str, String) {
    let id = zone.map_or("persons".to_owned(), |zone| format!("zone_{}", level(zone)));
    (SENSOR, id)
}

/// The component of numbers.
pub(super) const SENSOR: &str = "sensor";
/// The component of states that are on or off.
pub(super) const BINARY_SENSOR: &str = "binary_sensor";

/// The component of events.
pub(super) const EVENT: &str = "event";
/// The component of cameras: images that change.
pub(super) const CAMERA: &str = "camera";
/// The component of images.
pub(super) const IMAGE: &str = "image";
/// The component of switches.
pub(super) const SWITCH: &str = "switch";

/// A device of Home Assistant: a camera or a site.
pub(super) struct Device<'a> {
    /// The ID, unique in an installation.
    pub(super) id: String,
    /// The name that is shown.
    pub(super) name: &'a str,
}

impl Device<'_> {
    /// Returns the ID of an entity of this device.
    pub(super) fn entity_id(&self, entity: &str) -> String {
        format!("{}_{entity}", self.id)
    }

    /// Returns the topic and the payload that announce an entity. `config` has its own fields. The
    /// entity is available while all topics of `availability` are. `None` without a discovery
    /// prefix.
    pub(super) fn announcement(
        &self,
        topics: &Topics,
        component: &str,
        entity: &str,
        availability: impl IntoIterator<Item = String>,
        mut config: Value,
    ) -> Option<(String, String)> {
        let id = self.entity_id(entity);
        let topic = topics.config(component, &id)?;
        let version = env!("CARGO_PKG_VERSION");
        let availability = availability.into_iter();
        let availability: Vec<_> = availability.map(|topic| json!({"topic": topic})).collect();
        config["unique_id"] = json!(id);
        config["availability_mode"] = json!("all");
        config["availability"] = json!(availability);
        config["device"]["identifiers"] = json!([self.id]);
        config["device"]["name"] = json!(self.name);
        config["device"]["manufacturer"] = json!("Lookdown");
        config["device"]["sw_version"] = json!(version);
        config["origin"]["name"] = json!("Lookdown");
        config["origin"]["sw_version"] = json!(version);
        Some((topic, config.to_string()))
    }
}

/// Most owners and parts that are noted. Further ones stay with the broker.
const MAX_NOTED: usize = 10_000;

/// The owners of the retained topics that were received, such as cameras, by the levels of their
/// topics, with their parts, such as zones.
#[derive(Debug, Default)]
pub(super) struct RetainedTopics {
    owners: BTreeMap<String, BTreeSet<String>>,
    noted: usize,
}

impl RetainedTopics {
    /// Notes the owner of a retained topic, with the part that the topic names. Returns true for
    /// the first topic of the owner.
    pub(super) fn note(&mut self, owner: &str, part: Option<&str>) -> bool {
        if self.noted >= MAX_NOTED {
            return false;
        }
        let is_new = !self.owners.contains_key(owner);
        let parts = self.owners.entry(owner.to_owned()).or_default();
        let is_new_part = part.is_some_and(|part| parts.insert(part.to_owned()));
        self.noted += usize::from(is_new || is_new_part);
        is_new
    }

    /// Forgets an owner that another client publishes.
    pub(super) fn keep(&mut self, owner: &str) {
        self.owners.remove(owner);
    }

    /// Returns the noted owners with their parts, and forgets them.
    pub(super) fn take(&mut self) -> BTreeMap<String, BTreeSet<String>> {
        std::mem::take(self).owners
    }
}

/// The messages that remove a camera from the broker and from Home Assistant, with these parts:
/// `zones/` or `views/` and a name. Names may be levels of topics.
pub(super) fn withdrawal(
    topics: &Topics,
    camera: &str,
    parts: impl IntoIterator<Item = String>,
) -> Vec<Message> {
    let of_camera = [
        "persons",
        "frame_persons",
        "occupancy",
        "attributes",
        "availability",
    ];
    let mut messages = config_withdrawals(topics, camera, None);
    let of_camera = of_camera.map(|topic| topics.of_camera(camera, topic));
    messages.extend(of_camera.map(Message::forget));
    for part in parts {
        messages.extend(part_withdrawal(topics, camera, &part));
    }
    messages
}

/// The messages that remove a zone or a view from the broker and from Home Assistant.
pub(super) fn part_withdrawal(topics: &Topics, camera: &str, part: &str) -> Vec<Message> {
    let zone = match part.split_once('/') {
        Some(("views", view)) => {
            let topic = topics.view(camera, view);
            let config = view_withdrawal(topics, camera, view);
            return config.into_iter().chain([Message::forget(topic)]).collect();
        }
        Some((_, zone)) => zone,
        None => part,
    };
    let mut messages = config_withdrawals(topics, camera, Some(zone));
    let of_zone = [
        topics.zone(camera, zone),
        topics.zone_occupancy(camera, zone),
    ];
    messages.extend(of_zone.map(Message::forget));
    messages
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topics() -> Topics {
        Topics::new("lookdown", Some("homeassistant"))
    }

    fn config(message: &Message) -> Value {
        serde_json::from_slice(&message.payload).unwrap()
    }

    #[test]
    fn camera_and_zones_announce_occupancy_and_persons() {
        let discovery = Discovery::default();
        let messages = discovery.announcements(&topics(), "north gate", ["till"], []);
        let [occupancy, persons, frame, till, till_occupancy] = messages.as_slice() else {
            panic!("{messages:?}")
        };
        assert!(messages.iter().all(|message| message.retained));
        let device = "lookdown_north_gate-d44d9e17";
        let state = "lookdown/cameras/north_gate-d44d9e17";
        for (message, entity, state_topic) in [
            (occupancy, "binary_sensor/DEVICE_occupancy", "occupancy"),
            (persons, "sensor/DEVICE_persons", "persons"),
            (frame, "sensor/DEVICE_frame_persons", "frame_persons"),
            (till, "sensor/DEVICE_zone_till", "zones/till"),
            (
                till_occupancy,
                "binary_sensor/DEVICE_zone_till_occupancy",
                "zones/till/occupancy",
            ),
        ] {
            let entity = entity.replace("DEVICE", device);
            assert_eq!(message.topic, format!("homeassistant/{entity}/config"));
            let config = config(message);
            assert_eq!(config["state_topic"], format!("{state}/{state_topic}"));
            let availability = json!([
                {"topic": "lookdown/status"},
                {"topic": format!("{state}/availability")},
            ]);
            assert_eq!(config["availability"], availability);
            assert_eq!(config["availability_mode"], "all");
            let attributes = format!("{state}/attributes");
            assert_eq!(config["json_attributes_topic"], attributes);
            assert_eq!(config["device"]["name"], "north gate");
            assert_eq!(config["device"]["identifiers"][0], device);
            let version = env!("CARGO_PKG_VERSION");
            assert_eq!(config["device"]["sw_version"], version);
            assert_eq!(config["origin"]["sw_version"], version);
            assert!(config.get("expire_after").is_none());
            assert!(config["device"].get("configuration_url").is_none());
            assert!(config["origin"].get("support_url").is_none());
        }
        assert_eq!(config(occupancy)["device_class"], "occupancy");
        assert_eq!(config(frame)["enabled_by_default"], false);
        assert_eq!(config(frame)["entity_category"], "diagnostic");
        assert!(config(persons).get("entity_category").is_none());
    }

    #[test]
    fn expiry_and_addresses_come_from_the_settings() {
        let url = |text: &str| text.parse::<Url>().unwrap();
        let discovery = Discovery {
            expire_after: Some(Duration::from_mins(10)),
            configuration_url: Some(url("http://lookdown.local:8080/")),
            support_url: Some(url("https://help.example/")),
            images: ImagesOf::default(),
        };
        for message in discovery.announcements(&topics(), "lobby", ["till"], []) {
            let config = config(&message);
            assert_eq!(config["expire_after"], 600);
            let page = &config["device"]["configuration_url"];
            assert_eq!(page, "http://lookdown.local:8080/");
            assert_eq!(config["origin"]["support_url"], "https://help.example/");
        }
    }

    #[test]
    fn withdrawals_have_the_topics_of_announcements() {
        let discovery = Discovery {
            images: ImagesOf::All,
            ..Discovery::default()
        };
        let announced = discovery.announcements(&topics(), "lobby", ["till"], ["door"]);
        let mut withdrawn = config_withdrawals(&topics(), "lobby", None);
        withdrawn.extend(config_withdrawals(&topics(), "lobby", Some("till")));
        withdrawn.extend(view_withdrawal(&topics(), "lobby", "door"));
        let sorted = |messages: &[Message]| {
            let topics = messages.iter().map(|message| message.topic.clone());
            topics.collect::<std::collections::BTreeSet<_>>()
        };
        assert_eq!(sorted(&withdrawn), sorted(&announced));
        let is_empty = |message: &Message| message.payload.is_empty() && message.retained;
        assert!(withdrawn.iter().all(is_empty));
    }

    #[test]
    fn images_are_announced_for_cameras_that_have_them() {
        let discovery = Discovery {
            images: ImagesOf::Some(["lobby".to_owned()].into()),
            expire_after: Some(Duration::from_mins(1)),
            ..Discovery::default()
        };
        let image = |camera: &str| {
            let announced = discovery.announcements(&topics(), camera, [], []);
            let image = announced.into_iter().find(|message| {
                message.topic == format!("homeassistant/image/lookdown_{camera}_image/config")
            });
            image.map(|message| config(&message))
        };
        assert!(image("hall").is_none());
        let image = image("lobby").unwrap();
        assert_eq!(image["image_topic"], "lookdown/cameras/lobby/image");
        assert_eq!(image["content_type"], "image/jpeg");
        assert!(image.get("expire_after").is_none());
    }

    #[test]
    fn a_view_is_announced_as_a_camera_that_never_expires() {
        let discovery = Discovery {
            expire_after: Some(Duration::from_mins(1)),
            ..Discovery::default()
        };
        let announced = discovery.announcements(&topics(), "lobby", [], ["door"]);
        let view = announced.last().unwrap();
        let topic = "homeassistant/camera/lookdown_lobby_view_door/config";
        assert_eq!(view.topic, topic);
        let config = config(view);
        assert_eq!(config["topic"], "lookdown/cameras/lobby/views/door/image");
        assert_eq!(config["name"], "View door");
        assert!(config.get("expire_after").is_none());
    }

    #[test]
    fn a_switch_is_available_while_the_server_is() {
        let switch = Discovery::default().switch(&topics(), "hall").unwrap();
        let id = "homeassistant/switch/lookdown_hall_detection/config";
        assert_eq!((switch.topic.as_str(), switch.retained), (id, true));
        let config = config(&switch);
        assert_eq!(
            config["command_topic"],
            "lookdown/cameras/hall/detection/set"
        );
        assert_eq!(
            config["availability"],
            json!([{"topic": "lookdown/status"}])
        );
        let withdrawn = Discovery::switch_withdrawal(&topics(), "hall").unwrap();
        assert_eq!(withdrawn, Message::forget(id.to_owned()));
    }

    #[test]
    fn nothing_is_announced_without_a_discovery_prefix() {
        let topics = Topics::new("lookdown", None);
        let announced = Discovery::default().announcements(&topics, "lobby", ["till"], ["door"]);
        assert!(announced.is_empty());
        assert!(config_withdrawals(&topics, "lobby", None).is_empty());
    }
}

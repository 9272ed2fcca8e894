//! Announces a camera's entities to Home Assistant (its documentation: MQTT, section "MQTT
//! discovery"): occupancy, the number of persons, and the number in each zone.

use serde_json::{Value, json};

use super::{
    message::Message,
    topics::{Topics, level},
};

/// The status while the server is connected, and the one that the broker publishes when it is not.
pub(super) const ONLINE: &str = "online";
pub(super) const OFFLINE: &str = "offline";
const SENSOR: &str = "sensor";
const BINARY_SENSOR: &str = "binary_sensor";
/// Home Assistant's template for a state that is ON or OFF.
const IS_OCCUPIED: &str = "{{ 'ON' if value | int(0) > 0 else 'OFF' }}";

/// The announcements of a camera and its zones. Empty without a discovery prefix.
pub(super) fn announcements<'a>(
    topics: &Topics,
    camera: &str,
    zones: impl IntoIterator<Item = &'a str>,
) -> Vec<Message> {
    let occupancy = json!({
        "name": "Occupancy",
        "state_topic": topics.persons(camera),
        "device_class": "occupancy",
        "value_template": IS_OCCUPIED,
    });
    let persons = json!({
        "name": "Persons",
        "state_topic": topics.persons(camera),
        "state_class": "measurement",
        "icon": "mdi:account-group",
    });
    let zones = zones.into_iter().map(|zone| {
        let config = json!({
            "name": format!("Persons in {zone}"),
            "state_topic": topics.zone(camera, zone),
            "state_class": "measurement",
            "icon": "mdi:account-group",
        });
        (SENSOR, zone_entity(zone), config)
    });
    let of_camera = [
        (BINARY_SENSOR, "occupancy".to_owned(), occupancy),
        (SENSOR, "persons".to_owned(), persons),
    ];
    let all = of_camera.into_iter().chain(zones);
    all.filter_map(|(component, entity, config)| {
        let id = format!("{}_{entity}", topics.device_id(camera));
        let topic = topics.config(component, &id)?;
        let config = completed(config, &id, topics, camera);
        Some(Message::retained(topic, config.to_string()))
    })
    .collect()
}

/// The message that removes a zone from Home Assistant.
pub(super) fn withdrawal(topics: &Topics, camera: &str, zone: &str) -> Option<Message> {
    let id = format!("{}_{}", topics.device_id(camera), zone_entity(zone));
    topics.config(SENSOR, &id).map(Message::forget)
}

fn zone_entity(zone: &str) -> String {
    format!("zone_{}", level(zone))
}

/// Adds the fields that all entities of a camera have in common.
fn completed(mut config: Value, id: &str, topics: &Topics, camera: &str) -> Value {
    config["unique_id"] = json!(id);
    config["availability_topic"] = json!(topics.status());
    config["device"] = json!({
        "identifiers": [topics.device_id(camera)],
        "name": camera,
        "manufacturer": "Lookdown",
        "model": "Ceiling fisheye camera",
    });
    config["origin"] = json!({
        "name": "Lookdown",
        "sw_version": env!("CARGO_PKG_VERSION"),
    });
    config
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topics() -> Topics {
        Topics::new("lookdown", Some("homeassistant"))
    }

    #[test]
    fn a_camera_announces_occupancy_persons_and_zones() {
        let messages = announcements(&topics(), "north gate", ["till"]);
        let [occupancy, persons, till] = messages.as_slice() else {
            panic!("{messages:?}")
        };
        assert!(messages.iter().all(|message| message.retained));
        let config =
            |message: &Message| -> Value { serde_json::from_slice(&message.payload).unwrap() };
        let device = "lookdown_north_gate-d44d9e17";
        assert_eq!(
            occupancy.topic,
            format!("homeassistant/binary_sensor/{device}_occupancy/config")
        );
        assert_eq!(config(occupancy)["device_class"], "occupancy");
        assert_eq!(
            persons.topic,
            format!("homeassistant/sensor/{device}_persons/config")
        );
        assert_eq!(
            till.topic,
            format!("homeassistant/sensor/{device}_zone_till/config")
        );
        let state = "lookdown/cameras/north_gate-d44d9e17";
        assert_eq!(config(persons)["state_topic"], format!("{state}/persons"));
        assert_eq!(config(till)["state_topic"], format!("{state}/zones/till"));
        for message in [occupancy, persons, till] {
            let config = config(message);
            assert_eq!(config["availability_topic"], "lookdown/status");
            assert_eq!(config["device"]["name"], "north gate");
            assert_eq!(config["device"]["identifiers"][0], device);
        }
    }

    #[test]
    fn a_zone_is_withdrawn_on_its_announcement_topic() {
        let announced = announcements(&topics(), "lobby", ["till"]);
        let withdrawn = withdrawal(&topics(), "lobby", "till").unwrap();
        assert_eq!(withdrawn.topic, announced[2].topic);
        assert!(withdrawn.payload.is_empty() && withdrawn.retained);
    }

    #[test]
    fn nothing_is_announced_without_a_discovery_prefix() {
        let topics = Topics::new("lookdown", None);
        assert!(announcements(&topics, "lobby", ["till"]).is_empty());
        assert_eq!(withdrawal(&topics, "lobby", "till"), None);
    }
}

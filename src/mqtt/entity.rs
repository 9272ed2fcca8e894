//! The announcement of an entity to Home Assistant: the fields that all entities have in common.

use serde_json::{Value, json};

use super::topics::Topics;

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

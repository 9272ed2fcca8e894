//! The MQTT broker, as it is written and checked.

use serde::Deserialize;

use super::{SettingsError, check::count, unshown::Unshown};
use crate::mqtt::{BrokerError, MqttOptions};

/// Most bytes of a prefix: a topic has 65,535.
const MAX_PREFIX_BYTES: usize = 256;

/// Table `mqtt`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawMqtt {
    url: Unshown,
    authorities: String,
    topic_prefix: String,
    discovery_prefix: String,
    max_cameras: u64,
}

impl Default for RawMqtt {
    fn default() -> Self {
        Self {
            url: Unshown::default(),
            authorities: String::new(),
            topic_prefix: "lookdown".to_owned(),
            discovery_prefix: "homeassistant".to_owned(),
            max_cameras: 100,
        }
    }
}

impl RawMqtt {
    /// What is written; `None` where there is no broker.
    pub(super) fn checked(self) -> Result<Option<MqttOptions>, SettingsError> {
        let topic_prefix = prefix("mqtt.topic_prefix", self.topic_prefix)?;
        let max_cameras = count("mqtt.max_cameras", self.max_cameras)?;
        let discovery_prefix = (!self.discovery_prefix.is_empty())
            .then(|| prefix("mqtt.discovery_prefix", self.discovery_prefix))
            .transpose()?;
        if self.url.0.is_empty() {
            return Ok(None);
        }
        let refused = |error: BrokerError| SettingsError::Refused {
            key: "mqtt.url".to_owned(),
            problem: error.to_string(),
        };
        Ok(Some(MqttOptions {
            broker: self.url.0.parse().map_err(refused)?,
            authorities: (!self.authorities.is_empty()).then(|| self.authorities.into()),
            topic_prefix,
            discovery_prefix,
            max_cameras,
        }))
    }
}

/// The beginning of topics (MQTT 3.1.1, section 4.7): no wildcards, no empty level, none of the broker's
/// own.
fn prefix(key: &str, told: String) -> Result<String, SettingsError> {
    let is_level = |level: &str| {
        let mut characters = level.chars();
        !level.is_empty() && !characters.any(|c| c.is_control() || c == '+' || c == '#')
    };
    let fits = told.len() <= MAX_PREFIX_BYTES && !told.starts_with('$');
    if fits && told.split('/').all(is_level) {
        return Ok(told);
    }
    Err(SettingsError::Value {
        key: key.to_owned(),
        value: format!("{told:?}"),
        remedy: "give a topic such as lookdown or home/lookdown, without + and #".to_owned(),
    })
}

//! The MQTT broker; enabled by its URL.

use std::{num::NonZeroUsize, path::PathBuf};

use secrecy::{ExposeSecret, SecretString};

use super::{
    SettingsError,
    declare::settings,
    form::{Form, count, optional, path, secret, text},
};
use crate::mqtt::{Broker, BrokerError, MqttOptions};

/// Most bytes of a prefix: a topic has 65,535.
const MAX_PREFIX_BYTES: usize = 256;

settings! {
    /// The MQTT broker as it is written.
    #[derive(Debug, Clone)]
    pub(super) struct MqttKeys in "mqtt" {
        /// The broker that counts and reports are published to (docs/home-automation.md), such as
        /// `mqtt://user:password@192.168.1.10:1883`, or `mqtts://` for TLS. Empty: none. A URL with
        /// a password is better kept in the variable than in a file.
        url: Option<SecretString> = None => secret("URL of a broker");
        /// The PEM file of the certificate authorities of a broker with TLS. Empty: those that the
        /// system trusts.
        authorities: Option<PathBuf> = None => optional(path());
        /// The prefix of all topics.
        topic_prefix: String = "lookdown".to_owned() => topic();
        /// The prefix of the topics on which Home Assistant discovers entities. Empty: nothing is
        /// announced.
        discovery_prefix: Option<String> = Some("homeassistant".to_owned()) => optional(topic());
        /// The most cameras that are published: the first that send frames. Each is a device in
        /// Home Assistant.
        max_cameras: NonZeroUsize = NonZeroUsize::new(100).unwrap_or(NonZeroUsize::MIN) => count();
    }
}

impl MqttKeys {
    /// The options of the publisher; `None` where there is no broker.
    pub(super) fn checked(self) -> Result<Option<MqttOptions>, SettingsError> {
        let broker = self.url.map(|url| url.expose_secret().parse::<Broker>());
        let broker = broker
            .transpose()
            .map_err(|error: BrokerError| SettingsError::Hidden {
                key: "mqtt.url",
                problem: error.to_string(),
            })?;
        Ok(broker.map(|broker| MqttOptions {
            broker,
            authorities: self.authorities,
            topic_prefix: self.topic_prefix,
            discovery_prefix: self.discovery_prefix,
            max_cameras: self.max_cameras,
        }))
    }
}

/// The beginning of topics (MQTT 3.1.1, section 4.7): no wildcard, no empty level, and none of the
/// broker's own topics.
fn topic() -> Form<String> {
    let remedy = "a topic such as lookdown or home/lookdown, without + and #";
    text(remedy, |topic| {
        let is_level = |level: &str| {
            let mut characters = level.chars();
            !level.is_empty() && !characters.any(|c| c.is_control() || c == '+' || c == '#')
        };
        let fits = topic.len() <= MAX_PREFIX_BYTES && !topic.starts_with('$');
        fits && topic.split('/').all(is_level)
    })
}

//! The MQTT broker; enabled by its URL.

use std::{num::NonZeroUsize, path::PathBuf, time::Duration};

use lookdown_common::{Secret, read_secret};
use secrecy::{ExposeSecret, SecretString};
use url::Url;

use super::{
    SettingsError,
    declare::settings,
    form::{Form, count, optional, path, seconds, secret, text, web_address, zero_is_none},
};
use crate::{
    mqtt::{Broker, BrokerError, Discovery, MqttOptions},
    results::ImagesOf,
};

/// Most bytes of a prefix: a topic has 65,535.
const MAX_PREFIX_BYTES: usize = 256;
/// A week, seconds.
const MAX_EXPIRY: u64 = 7 * 86_400;

settings! {
    /// The MQTT broker as it is written.
    #[derive(Debug, Clone)]
    pub(super) struct MqttKeys in "mqtt" {
        /// The broker that counts and reports are published to (docs/home-automation.md), such as
        /// `mqtt://user@192.168.1.10:1883`, or `mqtts://` for TLS. Empty: none. It may hold the
        /// password, percent-encoded: `mqtt://user:password@…`.
        url: Option<SecretString> = None => secret("URL of a broker");
        /// The password of the user in that URL, as it is. Empty: the password of the URL. It is
        /// better kept in the variable than in a file that others can read.
        password: Option<SecretString> = None => secret("password");
        /// The file with that password on its first line, instead of `mqtt.password`. Empty: none.
        password_file: Option<PathBuf> = None => optional(path());
        /// The PEM file of the certificate authorities of a broker with TLS. Empty: those that the
        /// system trusts.
        authorities: Option<PathBuf> = None => optional(path());
        /// The prefix of all topics.
        topic_prefix: String = "lookdown".to_owned() => topic();
        /// The prefix of the topics on which Home Assistant discovers entities. Empty: nothing is
        /// announced.
        discovery_prefix: Option<String> = Some("homeassistant".to_owned()) => optional(topic());
        /// The most cameras that are published, beside those that this process reads. Each is a
        /// device in Home Assistant.
        max_cameras: NonZeroUsize = NonZeroUsize::new(100).unwrap_or(NonZeroUsize::MIN) => count();
        /// The time without a person after which occupancy is off: single frames that miss a person
        /// change nothing. 0: each frame counts.
        hold as "hold_seconds": Duration = Duration::from_secs(5) => seconds(0..=3600);
        /// The shortest time between two images of a camera or of one of its views that are
        /// published, for cameras in `results.images`. Images show persons, unless
        /// `results.conceal_images` conceals them. 0: no images.
        image_every as "image_every_seconds": Option<Duration> = None
            => zero_is_none(seconds(0..=86_400));
        /// The time without a report after which a camera is unavailable. It must be longer than
        /// the interval of its frames. Retained topics of removed cameras are withdrawn as long
        /// after a connection. 0: cameras stay available.
        expire_after as "expire_after_seconds": Option<Duration> = Some(Duration::from_mins(10))
            => zero_is_none(seconds(0..=MAX_EXPIRY));
        /// The address of the server's web page, which Home Assistant shows with each camera.
        /// Empty: none.
        configuration_url: Option<Url> = None => optional(web_address());
        /// The address at which users of this installation get help, which Home Assistant shows
        /// with its logs. Empty: none.
        support_url: Option<Url> = None => optional(web_address());
    }
}

impl MqttKeys {
    /// The options of the publisher; `None` where there is no broker.
    pub(super) fn checked(self) -> Result<Option<MqttOptions>, SettingsError> {
        let broker = self.url.map(|url| url.expose_secret().parse::<Broker>());
        let mut broker = broker
            .transpose()
            .map_err(|error: BrokerError| SettingsError::hidden("mqtt.url", error))?;
        let in_file = self.password_file.as_deref();
        let in_file = in_file.map(|path| read_secret("mqtt.password_file", path));
        if let Some(password) = self.password.map(Secret::from).or(in_file.transpose()?) {
            let with_password = |broker: Broker| broker.with_password(password.expose_secret());
            broker = broker
                .map(with_password)
                .transpose()
                .map_err(|error| SettingsError::hidden("mqtt.password", error))?;
        }
        Ok(broker.map(|broker| MqttOptions {
            broker,
            authorities: self.authorities,
            topic_prefix: self.topic_prefix,
            discovery_prefix: self.discovery_prefix,
            max_cameras: self.max_cameras,
            hold: self.hold,
            image_every: self.image_every,
            discovery: Discovery {
                expire_after: self.expire_after,
                configuration_url: self.configuration_url,
                support_url: self.support_url,
                // `results.images` says which, where all settings are known.
                images: ImagesOf::default(),
            },
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

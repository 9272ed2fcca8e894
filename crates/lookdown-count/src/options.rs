//! The settings of `lookdown count`: a TOML file, or flags.

use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
    time::Duration,
};

use lookdown_common::{
    ConfigError, ServerEntry, ServerOptions, optional_duration, parse_toml, read_file, read_secret,
};
use reqwest::Url;
use secrecy::{ExposeSecret, SecretString};
use serde::Deserialize;

use crate::webhooks::{Webhook, WebhookEntry};

/// Defaults.
const STORE: &str = "counts.sqlite";
const LISTEN: &str = "127.0.0.1:8090";
const RETENTION_DAYS: u32 = 90;
const LONGEST_GAP: Duration = Duration::from_secs(10);
const COMMIT_EVERY: Duration = Duration::from_secs(2);
const MAX_CAMERAS: usize = 64;
/// Most webhooks.
const MAX_WEBHOOKS: usize = 32;
/// Shortest API key of a reader.
const LEAST_KEY_CHARS: usize = 16;

/// The settings as they are written in the file or on the command line.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CountEntry {
    /// The server.
    #[serde(default)]
    pub server: ServerEntry,
    /// The HTTP API.
    #[serde(default)]
    pub http: HttpEntry,
    /// The store.
    #[serde(default)]
    pub store: StoreEntry,
    /// Counting.
    #[serde(default)]
    pub counting: CountingEntry,
    /// The MQTT broker.
    pub mqtt: Option<MqttEntry>,
    /// Receivers of messages.
    #[serde(default)]
    pub webhooks: Vec<WebhookEntry>,
}

/// The HTTP API as it is written.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HttpEntry {
    /// The address.
    pub listen: Option<SocketAddr>,
    /// A file with the key that requests must have.
    pub api_key_file: Option<PathBuf>,
    /// True to answer every client of an address that other machines reach, without a key.
    pub open: Option<bool>,
}

/// The store as it is written.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoreEntry {
    /// The file.
    pub path: Option<PathBuf>,
    /// Days after which sums are removed.
    pub retention_days: Option<u32>,
    /// The interval of the transactions.
    pub commit_every: Option<String>,
}

/// Counting as it is written.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CountingEntry {
    /// The longest time between two reports of a camera that is known.
    pub longest_gap: Option<String>,
    /// Most cameras.
    pub max_cameras: Option<usize>,
}

/// The MQTT broker as it is written. The program that composes the companion connects to it.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MqttEntry {
    /// The URL of the broker, without a password.
    pub url: String,
    /// A file with the password.
    pub password_file: Option<PathBuf>,
    /// A PEM file with the authorities of the broker's certificate.
    pub authorities: Option<PathBuf>,
    /// The prefix of all topics.
    #[serde(default = "topic_prefix")]
    pub topic_prefix: String,
    /// The prefix of the topics of Home Assistant; empty disables discovery.
    #[serde(default = "discovery_prefix")]
    pub discovery_prefix: String,
}

impl MqttEntry {
    /// Returns the URL of the broker with the password of the file.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn url_with_password(&self) -> Result<String, ConfigError> {
        let Some(path) = &self.password_file else {
            return Ok(self.url.clone());
        };
        let password = read_secret("mqtt.password_file", path)?;
        let mut url = Url::parse(&self.url).ok();
        let url = url.as_mut().filter(|url| !url.username().is_empty());
        let with_password = url.and_then(|url| {
            url.set_password(Some(password.expose_secret())).ok()?;
            Some(url.to_string())
        });
        with_password.ok_or_else(|| {
            let problem =
                "it has no user name for the password: write it like mqtt://user@host:1883";
            ConfigError::problem("mqtt.url", &problem)
        })
    }
}

fn topic_prefix() -> String {
    "lookdown".to_owned()
}

fn discovery_prefix() -> String {
    "homeassistant".to_owned()
}

/// The checked settings.
#[derive(Debug, Clone)]
pub struct CountOptions {
    /// The server.
    pub server: ServerOptions,
    /// The address of the HTTP API.
    pub listen: SocketAddr,
    /// The key that requests to the HTTP API must have.
    pub api_key: Option<SecretString>,
    /// The file of the store.
    pub store: PathBuf,
    /// The time after which sums are removed.
    pub retention: Duration,
    /// The interval of the transactions.
    pub commit_every: Duration,
    /// The longest time between two reports of a camera that is known.
    pub longest_gap: Duration,
    /// Most cameras.
    pub max_cameras: usize,
    /// The MQTT broker.
    pub mqtt: Option<MqttEntry>,
    /// Receivers of messages.
    pub(crate) webhooks: Vec<Webhook>,
}

impl PartialEq for CountOptions {
    fn eq(&self, other: &Self) -> bool {
        let key = |options: &Self| {
            let key = options.api_key.as_ref();
            key.map(|key| key.expose_secret().to_owned())
        };
        let plain = |options: &Self| {
            (
                options.listen,
                options.store.clone(),
                [options.retention, options.commit_every, options.longest_gap],
                options.max_cameras,
            )
        };
        self.server == other.server
            && key(self) == key(other)
            && plain(self) == plain(other)
            && self.mqtt == other.mqtt
            && self.webhooks == other.webhooks
    }
}

/// Reads and checks a file of settings and the files that it names. `flags` has precedence. Paths are
/// relative to the current folder. Blocks.
///
/// # Errors
/// [`ConfigError`].
pub fn load(path: Option<&Path>, flags: &CountEntry) -> Result<CountOptions, ConfigError> {
    let file = match path {
        Some(path) => {
            let text = read_file("settings", path)?;
            parse_toml(&String::from_utf8_lossy(&text), "settings", "docs/count.md")?
        }
        None => CountEntry::default(),
    };
    flags.clone().or(file).check()
}

impl CountEntry {
    /// Fills absent values with those of another entry.
    fn or(self, other: Self) -> Self {
        Self {
            server: self.server.or(&other.server),
            http: HttpEntry {
                listen: self.http.listen.or(other.http.listen),
                api_key_file: self.http.api_key_file.or(other.http.api_key_file),
                open: self.http.open.or(other.http.open),
            },
            store: StoreEntry {
                path: self.store.path.or(other.store.path),
                retention_days: self.store.retention_days.or(other.store.retention_days),
                commit_every: self.store.commit_every.or(other.store.commit_every),
            },
            counting: CountingEntry {
                longest_gap: self.counting.longest_gap.or(other.counting.longest_gap),
                max_cameras: self.counting.max_cameras.or(other.counting.max_cameras),
            },
            mqtt: self.mqtt.or(other.mqtt),
            webhooks: if self.webhooks.is_empty() {
                other.webhooks
            } else {
                self.webhooks
            },
        }
    }

    /// Checks the entry and reads its files.
    fn check(self) -> Result<CountOptions, ConfigError> {
        let seconds = Duration::from_secs;
        let longest_gap = seconds(1)..=seconds(600);
        let commit_every = Duration::from_millis(100)..=seconds(60);
        let retention_days = self.store.retention_days.unwrap_or(RETENTION_DAYS);
        if !(1..=3660).contains(&retention_days) {
            let remedy = "is out of range: give 1 to 3660 days";
            return Err(ConfigError::value(
                "store.retention_days",
                &retention_days,
                remedy,
            ));
        }
        let max_cameras = self.counting.max_cameras.unwrap_or(MAX_CAMERAS);
        if !(1..=1024).contains(&max_cameras) {
            let remedy = "is out of range: give 1 to 1024";
            return Err(ConfigError::value(
                "counting.max_cameras",
                &max_cameras,
                remedy,
            ));
        }
        if self.webhooks.len() > MAX_WEBHOOKS {
            let remedy = "webhooks are too many: give at most 32";
            return Err(ConfigError::value("webhooks", &self.webhooks.len(), remedy));
        }
        let key_file = self.http.api_key_file.as_deref();
        let api_key = key_file
            .map(|path| read_secret("http.api_key_file", path))
            .transpose()?;
        if api_key
            .as_ref()
            .is_some_and(|key| key.expose_secret().len() < LEAST_KEY_CHARS)
        {
            let problem = "the key is too short: write at least 16 characters into the file";
            return Err(ConfigError::problem("http.api_key_file", &problem));
        }
        let listen = match self.http.listen {
            Some(listen) => listen,
            None => LISTEN
                .parse()
                .map_err(|error| ConfigError::problem("http.listen", &error))?,
        };
        let is_open = self.http.open.unwrap_or_default();
        if !listen.ip().is_loopback() && api_key.is_none() && !is_open {
            let remedy = "is reached by other machines: set http.api_key_file, or set http.open to \
                          true to let every client read the counts";
            return Err(ConfigError::value("http.listen", &listen, remedy));
        }
        let webhooks = self.webhooks.into_iter().enumerate();
        let webhooks = webhooks.map(|(index, entry)| entry.check(&format!("webhooks[{index}].")));
        Ok(CountOptions {
            server: self.server.check()?,
            listen,
            api_key,
            store: self.store.path.unwrap_or_else(|| STORE.into()),
            retention: seconds(u64::from(retention_days) * 86_400),
            commit_every: optional_duration(
                "store.commit_every",
                self.store.commit_every.as_deref(),
                commit_every,
            )?
            .unwrap_or(COMMIT_EVERY),
            longest_gap: optional_duration(
                "counting.longest_gap",
                self.counting.longest_gap.as_deref(),
                longest_gap,
            )?
            .unwrap_or(LONGEST_GAP),
            max_cameras,
            mqtt: self.mqtt,
            webhooks: webhooks.collect::<Result<_, _>>()?,
        })
    }
}

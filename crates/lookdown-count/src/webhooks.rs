//! Webhooks: signed messages on conditions (Standard Webhooks 1.0).

mod conditions;
mod delivery;
mod signature;

use std::{path::PathBuf, time::Duration};

use base64::{Engine as _, engine::general_purpose::STANDARD};
use lookdown_common::{ConfigError, optional_duration, read_secret};
use reqwest::Url;
use secrecy::ExposeSecret;
use serde::{Deserialize, Serialize};
use serde_json::json;
use sha2::{Digest, Sha256};

pub(crate) use conditions::Conditions;
pub(crate) use delivery::Deliveries;
use signature::SigningKey;

/// Time without a report after which a camera is silent.
const SILENT_AFTER: Duration = Duration::from_mins(1);

/// A webhook as it is written.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WebhookEntry {
    url: String,
    secret_file: PathBuf,
    on: Occasion,
    camera: Option<String>,
    line: Option<String>,
    direction: Option<String>,
    zone: Option<String>,
    at_least: Option<u64>,
    after: Option<String>,
    #[serde(default)]
    image: bool,
}

/// The kind of a condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Occasion {
    Crossing,
    Occupancy,
    Silent,
    FloorAlert,
}

/// A checked webhook.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Webhook {
    pub(crate) url: Url,
    pub(crate) key: SigningKey,
    pub(crate) camera: Option<String>,
    pub(crate) condition: Condition,
    /// True if its messages have the latest image of the camera.
    pub(crate) with_image: bool,
}

/// The condition of a webhook.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) enum Condition {
    /// Each crossing.
    Crossing {
        line: Option<String>,
        direction: Option<String>,
    },
    /// The persons in a zone, or of the camera, reach a number.
    Occupancy { zone: Option<String>, at_least: u64 },
    /// A camera has no report for this time.
    Silent { after: Duration },
    /// Someone is on the floor of a camera (`counts.floor_alert`).
    FloorAlert,
}

impl Webhook {
    /// Returns a digest of everything but the key: it identifies the webhook in the store, where
    /// its URL may hold a password.
    fn digest(&self) -> String {
        let text = json!([self.url.as_str(), self.camera, self.condition]).to_string();
        STANDARD.encode(Sha256::digest(text))
    }
}

impl WebhookEntry {
    /// Checks the entry and reads its secret.
    pub(crate) fn check(self, prefix: &str) -> Result<Webhook, ConfigError> {
        let field = |name: &str| format!("{prefix}{name}");
        let url = Url::parse(&self.url).ok();
        let url = url.filter(|url| matches!(url.scheme(), "http" | "https"));
        let Some(url) = url else {
            // It may hold a password.
            let shown = self.url.rsplit('@').next().unwrap_or_default();
            let remedy = "is not a URL of a receiver: write it like https://example.com/hook";
            return Err(ConfigError::value(&field("url"), shown, remedy));
        };
        let secret = read_secret(&field("secret_file"), &self.secret_file)?;
        let key = SigningKey::parse(secret.expose_secret());
        let key = key.map_err(|problem| ConfigError::problem(&field("secret_file"), &problem))?;
        for (name, is_given, belongs) in [
            ("line", self.line.is_some(), self.on == Occasion::Crossing),
            (
                "direction",
                self.direction.is_some(),
                self.on == Occasion::Crossing,
            ),
            ("zone", self.zone.is_some(), self.on == Occasion::Occupancy),
            (
                "at_least",
                self.at_least.is_some(),
                self.on == Occasion::Occupancy,
            ),
            ("after", self.after.is_some(), self.on == Occasion::Silent),
            ("image", self.image, self.on != Occasion::Silent),
        ] {
            if is_given && !belongs {
                let problem = "it does not belong to this condition: remove it, or change `on`";
                return Err(ConfigError::problem(&field(name), &problem));
            }
        }
        let condition = match self.on {
            Occasion::Crossing => Condition::Crossing {
                line: self.line,
                direction: self.direction,
            },
            Occasion::FloorAlert => Condition::FloorAlert,
            Occasion::Occupancy => {
                let at_least = self.at_least.unwrap_or(1);
                if at_least == 0 {
                    let remedy = "is always reached: give 1 or more";
                    return Err(ConfigError::value(&field("at_least"), &at_least, remedy));
                }
                Condition::Occupancy {
                    zone: self.zone,
                    at_least,
                }
            }
            Occasion::Silent => {
                let limits = Duration::from_secs(5)..=Duration::from_hours(24);
                let after = optional_duration(&field("after"), self.after.as_deref(), limits)?;
                Condition::Silent {
                    after: after.unwrap_or(SILENT_AFTER),
                }
            }
        };
        Ok(Webhook {
            url,
            key,
            camera: self.camera,
            condition,
            with_image: self.image,
        })
    }
}

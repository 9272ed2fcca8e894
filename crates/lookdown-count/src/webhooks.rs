//! Webhooks: signed messages on conditions (Standard Webhooks 1.0).

mod delivery;

pub(crate) use delivery::Deliveries;

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    time::Duration,
};

use base64::{Engine as _, engine::general_purpose::STANDARD};
use lookdown_common::{ConfigError, optional_duration, read_secret};
use reqwest::Url;
use ring::hmac;
use secrecy::{ExposeSecret, SecretSlice};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::{
    now::{Now, time_of},
    scene::Scene,
    scene_camera::NamedCrossing,
    store::write::{HeldCondition, Message},
};

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

/// The messages of a camera that becomes silent, and that sends reports again.
const SILENCE: [&str; 2] = ["camera.silent", "camera.back"];

/// The conditions and whether they hold.
pub(crate) struct Conditions {
    webhooks: Vec<Webhook>,
    /// Webhook and camera of each condition that holds.
    holding: BTreeSet<(usize, String)>,
    /// True if the stored state is another one.
    is_changed: bool,
    /// Last report of each camera, milliseconds since the Unix epoch, but no later than its
    /// arrival: a camera whose report is of the future may be silent all the same.
    reports: BTreeMap<String, i64>,
    /// Time of the start, milliseconds since the Unix epoch. No camera is silent for longer:
    /// reports of the time before may still arrive.
    started_ms: i64,
}

impl Conditions {
    /// Continues with the stored conditions that hold and the last report of each camera.
    /// Conditions of webhooks that are gone are left out.
    pub(crate) fn resumed(
        webhooks: Vec<Webhook>,
        held: &[HeldCondition],
        reports: BTreeMap<String, i64>,
        started_ms: i64,
    ) -> Self {
        let mut holding = BTreeSet::new();
        for (index, webhook) in webhooks.iter().enumerate() {
            let digest = webhook.digest();
            let own = held.iter().filter(|held| held.webhook == digest);
            holding.extend(own.map(|held| (index, held.camera.clone())));
        }
        Self {
            is_changed: holding.len() != held.len(),
            webhooks,
            holding,
            reports: reports
                .into_iter()
                .map(|(camera, at_ms)| (camera, at_ms.min(started_ms)))
                .collect(),
            started_ms,
        }
    }

    /// Takes the conditions that hold, if they are to be stored again.
    pub(crate) fn take_changed(&mut self) -> Option<BTreeSet<HeldCondition>> {
        if !std::mem::take(&mut self.is_changed) {
            return None;
        }
        let held = self.holding.iter().filter_map(|(index, camera)| {
            Some(HeldCondition {
                webhook: self.webhooks.get(*index)?.digest(),
                camera: camera.clone(),
            })
        });
        Some(held.collect())
    }

    /// Returns the messages of a counted report of the time `at_ms`, which arrived now.
    pub(crate) fn for_report(
        &mut self,
        event: u64,
        camera: &str,
        at_ms: i64,
        now: Now,
        crossings: &[NamedCrossing],
        scene: &Scene,
    ) -> Vec<Message> {
        let mut messages = Vec::new();
        for (index, webhook) in self.webhooks.iter().enumerate() {
            let is_of = |name: &str| {
                webhook
                    .camera
                    .as_deref()
                    .is_none_or(|camera| camera == name)
            };
            let (holds, names, data) = match &webhook.condition {
                Condition::Crossing { line, direction } => {
                    let fits = |crossing: &&NamedCrossing| {
                        let of = &crossing.of;
                        is_of(&of.camera)
                            && line.as_ref().is_none_or(|line| *line == of.line)
                            && direction.as_ref().is_none_or(|name| *name == of.direction)
                    };
                    for (number, crossing) in crossings.iter().filter(fits).enumerate() {
                        let of = &crossing.of;
                        let data = json!({
                            "camera": of.camera, "line": of.line, "direction": of.direction,
                        });
                        let id = format!("msg_{event}_{index}_{number}");
                        messages.push(message(id, webhook, "crossing", crossing.at_ms, &data));
                    }
                    continue;
                }
                _ if !is_of(camera) => continue,
                Condition::Occupancy { zone, at_least } => {
                    let persons = scene.camera(camera).and_then(|(_, of)| match zone {
                        Some(zone) => {
                            let mut zones = of.occupancy().filter(|(name, _)| name == zone);
                            zones.next().map(|(_, persons)| persons as u64)
                        }
                        None => Some(of.presence.persons),
                    });
                    let Some(persons) = persons else {
                        continue;
                    };
                    let data = json!({
                        "camera": camera, "zone": zone, "persons": persons, "at_least": at_least,
                    });
                    let names = ["occupancy.reached", "occupancy.ended"];
                    (persons >= *at_least, names, data)
                }
                Condition::Silent { .. } => (false, SILENCE, json!({ "camera": camera })),
                Condition::FloorAlert => {
                    let Some((_, of)) = scene.camera(camera) else {
                        continue;
                    };
                    let alerts = of.floor.alerts().map(|person| {
                        json!({
                            "posture": person.posture.name(), "since": time_of(person.since_ms),
                            "zone": person.zone,
                        })
                    });
                    let alerts: Vec<_> = alerts.collect();
                    let names = ["floor_alert.began", "floor_alert.ended"];
                    let holds = !alerts.is_empty();
                    (holds, names, json!({ "camera": camera, "persons": alerts }))
                }
            };
            let changed = change(&mut self.holding, (index, camera), holds, names);
            self.is_changed |= changed.is_some();
            let id = format!("msg_{event}_{index}");
            messages.extend(changed.map(|name| message(id, webhook, name, at_ms, &data)));
        }
        self.reports
            .insert(camera.to_owned(), at_ms.min(now.unix_ms));
        messages
    }

    /// Returns the messages of the time: cameras that became silent.
    pub(crate) fn for_time(&mut self, now_ms: i64) -> Vec<Message> {
        let mut messages = Vec::new();
        for (index, webhook) in self.webhooks.iter().enumerate() {
            let Condition::Silent { after } = webhook.condition else {
                continue;
            };
            for (camera, last_ms) in &self.reports {
                let is_of = webhook.camera.as_ref().is_none_or(|name| name == camera);
                let since_ms = self.started_ms.max(*last_ms);
                let silence = u128::from(now_ms.saturating_sub(since_ms).max(0).unsigned_abs());
                if !is_of || silence < after.as_millis() {
                    continue;
                }
                let data = json!({ "camera": camera, "last_report": time_of(*last_ms) });
                let id = format!("msg_{last_ms}_{index}_silent");
                let changed = change(&mut self.holding, (index, camera), true, SILENCE);
                self.is_changed |= changed.is_some();
                messages.extend(changed.map(|name| message(id, webhook, name, now_ms, &data)));
            }
        }
        messages
    }
}

/// Records that a condition holds or not. Returns the name of the change: the first when it begins
/// to hold, the second when it ends.
fn change(
    holding: &mut BTreeSet<(usize, String)>,
    (index, camera): (usize, &str),
    holds: bool,
    [begun, ended]: [&'static str; 2],
) -> Option<&'static str> {
    let key = (index, camera.to_owned());
    if holds {
        holding.insert(key).then_some(begun)
    } else {
        holding.remove(&key).then_some(ended)
    }
}

fn message(id: String, webhook: &Webhook, kind: &str, at_ms: i64, data: &Value) -> Message {
    let body = json!({ "type": kind, "timestamp": time_of(at_ms), "data": data });
    Message {
        id,
        webhook: webhook.digest(),
        body: body.to_string(),
        created_s: at_ms.div_euclid(1000),
    }
}

/// The prefix of secrets.
const PREFIX: &str = "whsec_";
/// Bytes of a secret.
const BYTES: std::ops::RangeInclusive<usize> = 24..=64;

/// The secret that a receiver shares.
#[derive(Debug, Clone)]
pub(crate) struct SigningKey(SecretSlice<u8>);

impl PartialEq for SigningKey {
    fn eq(&self, other: &Self) -> bool {
        self.0.expose_secret() == other.0.expose_secret()
    }
}

impl SigningKey {
    /// Parses a secret, `whsec_` and base64. The error does not repeat it.
    pub(crate) fn parse(text: &str) -> Result<Self, &'static str> {
        let problem = "the secret is invalid: write whsec_ and the base64 of 24 to 64 random bytes, such as \
                       `echo whsec_$(openssl rand -base64 32)` prints";
        let encoded = text.trim().strip_prefix(PREFIX).ok_or(problem)?;
        let bytes = STANDARD.decode(encoded).map_err(|_| problem)?;
        if !BYTES.contains(&bytes.len()) {
            return Err(problem);
        }
        Ok(Self(bytes.into()))
    }

    /// Returns the header `webhook-signature`.
    pub(crate) fn sign(&self, id: &str, timestamp_s: i64, body: &str) -> String {
        let key = hmac::Key::new(hmac::HMAC_SHA256, self.0.expose_secret());
        let signed = format!("{id}.{timestamp_s}.{body}");
        let signature = hmac::sign(&key, signed.as_bytes());
        format!("v1,{}", STANDARD.encode(signature))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_of_the_specification_is_reproduced() {
        let key = SigningKey::parse("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap();
        let signature = key.sign(
            "msg_p5jXN8AQM9LWM0D4loKWxJek",
            1_614_265_330,
            r#"{"test": 2432232314}"#,
        );
        assert_eq!(signature, "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
    }

    #[test]
    fn other_secrets_are_refused() {
        for secret in [
            "",
            "MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw",
            "whsec_short",
            "whsec_!",
        ] {
            assert!(SigningKey::parse(secret).is_err(), "{secret}");
        }
    }
}

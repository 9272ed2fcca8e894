//! Publishes the counts of `lookdown count`: totals, occupancy and dwell times.

use std::{
    collections::BTreeMap,
    future::Future,
    path::PathBuf,
    pin::{Pin, pin},
};

use lookdown_count::Snapshot;
use serde_json::{Value, json};
use tokio::{
    sync::watch,
    time::{Instant, sleep},
};
use uuid::Uuid;

use super::{
    Broker,
    discovery::{OFFLINE, ONLINE},
    message::Message,
    session::{Session, SessionError, reconnect_backoff},
    topics::level,
};
use crate::tls::{ClientTls, TlsError};

/// The broker of the counts, and the settings of the messages.
pub struct CountsOptions {
    /// The broker.
    pub broker: Broker,
    /// PEM file of the authorities of a broker with TLS. `None` trusts those of the system.
    pub authorities: Option<PathBuf>,
    /// The prefix of all topics.
    pub topic_prefix: String,
    /// The prefix of the topics of Home Assistant. `None` disables discovery.
    pub discovery_prefix: Option<String>,
}

/// Publishes counts.
pub struct CountsPublisher {
    options: CountsOptions,
    tls: Option<ClientTls>,
    client_id: String,
    snapshots: watch::Receiver<Snapshot>,
}

/// The retained messages: payloads by topic.
type Retained = BTreeMap<String, String>;

impl CountsPublisher {
    /// Creates a publisher that is not connected yet.
    ///
    /// # Errors
    /// [`TlsError`] when the authorities cannot be used.
    pub fn new(
        options: CountsOptions,
        snapshots: watch::Receiver<Snapshot>,
    ) -> Result<Self, TlsError> {
        Ok(Self {
            tls: options.broker.tls(options.authorities.as_deref())?,
            client_id: format!("lookdown-count-{}", Uuid::new_v4().simple()),
            options,
            snapshots,
        })
    }

    /// Publishes until the counts end, and then publishes the status "offline".
    pub async fn run(mut self) {
        let mut snapshots = self.snapshots.clone();
        let mut stop = pin!(async move { while snapshots.changed().await.is_ok() {} });
        let mut backoff = reconnect_backoff();
        let mut has_warned = false;
        loop {
            let began = Instant::now();
            let Err(error) = self.serve(&mut has_warned, stop.as_mut()).await else {
                return;
            };
            backoff.reset_if_stable(began.elapsed());
            if !has_warned {
                let broker = &self.options.broker;
                tracing::warn!("not publishing to the broker {broker} (mqtt.url): {error}");
            }
            has_warned = true;
            tokio::select! {
                () = sleep(backoff.next_pause()) => {}
                () = &mut stop => return,
            }
        }
    }

    /// Connects, and publishes every change until the connection or the counts end.
    async fn serve(
        &mut self,
        has_warned: &mut bool,
        mut stop: Pin<&mut impl Future<Output = ()>>,
    ) -> Result<(), SessionError> {
        let broker = &self.options.broker;
        let status = |status: &'static str| Message::retained(self.topic("counts/status"), status);
        let (online, offline) = (status(ONLINE), status(OFFLINE));
        let opened = Session::open(broker, self.tls.as_ref(), &self.client_id, offline.clone());
        let mut session = tokio::select! {
            session = opened => session?,
            () = &mut stop => return Ok(()),
        };
        tracing::info!("publishing to the broker {broker} (mqtt.url)");
        *has_warned = false;
        session.publish([online]).await?;
        let birth = self.options.discovery_prefix.as_ref();
        let birth = birth.map(|prefix| format!("{prefix}/status"));
        if let Some(birth) = &birth {
            session.subscribe([birth.clone()]).await?;
        }
        let mut published = Retained::new();
        loop {
            let snapshot = self.snapshots.borrow_and_update().clone();
            let wanted = self.retained(&snapshot);
            session.publish(changes(&published, &wanted)).await?;
            published = wanted;
            tokio::select! {
                message = session.next() => {
                    let message = message?;
                    if birth.as_ref() == Some(&message.topic) && message.payload == ONLINE {
                        published.clear();
                    }
                }
                Ok(()) = self.snapshots.changed() => {}
                () = &mut stop => return session.close(offline).await,
            }
        }
    }

    fn topic(&self, rest: &str) -> String {
        format!("{}/{rest}", self.options.topic_prefix)
    }

    /// Returns all messages that the broker is to retain.
    fn retained(&self, snapshot: &Snapshot) -> Retained {
        let mut retained = Retained::new();
        for camera in &snapshot.cameras {
            let name = level(&camera.name);
            let base = self.topic(&format!("counts/cameras/{name}"));
            let id = format!("{}_{name}", level(&self.options.topic_prefix));
            let shown = camera.name.clone();
            let mut device = Device::new(self, id, shown, &base, camera.persons, &mut retained);
            for line in &camera.lines {
                let (line_level, direction) = (level(&line.line), level(&line.direction));
                device.total(
                    &format!("{} {}", line.line, line.direction),
                    &format!("line_{line_level}_{direction}"),
                    format!("{base}/lines/{line_level}/{direction}"),
                    line.crossings,
                    &json!({}),
                );
            }
            for zone in &camera.zones {
                let name = level(&zone.zone);
                let topic = |rest: &str| format!("{base}/zones/{name}/{rest}");
                device.state(
                    &format!("Tracked persons in {}", zone.zone),
                    &format!("tracked_in_{name}"),
                    topic("persons"),
                    zone.persons,
                );
                device.total(
                    &format!("Entries into {}", zone.zone),
                    &format!("entries_{name}"),
                    topic("entries"),
                    zone.entries,
                    &json!({}),
                );
                device.total(
                    &format!("Dwell time in {}", zone.zone),
                    &format!("dwell_{name}"),
                    topic("dwell_seconds"),
                    zone.person_ms / 1000,
                    &json!({ "device_class": "duration", "unit_of_measurement": "s" }),
                );
            }
        }
        for site in &snapshot.sites {
            let name = level(&site.name);
            let base = self.topic(&format!("counts/sites/{name}"));
            let id = format!("{}_site_{name}", level(&self.options.topic_prefix));
            let shown = format!("Site {}", site.name);
            Device::new(self, id, shown, &base, site.persons, &mut retained);
        }
        retained
    }
}

/// The entities of a camera or a site.
struct Device<'a> {
    publisher: &'a CountsPublisher,
    id: String,
    name: String,
    availability: String,
    retained: &'a mut Retained,
}

impl<'a> Device<'a> {
    /// A device with its availability and the number of its persons, below the topic `base`.
    fn new(
        publisher: &'a CountsPublisher,
        id: String,
        name: String,
        base: &str,
        persons: Option<u64>,
        retained: &'a mut Retained,
    ) -> Self {
        let availability = format!("{base}/availability");
        let is_known = if persons.is_some() { ONLINE } else { OFFLINE };
        retained.insert(availability.clone(), is_known.to_owned());
        let mut device = Self {
            publisher,
            id,
            name,
            availability,
            retained,
        };
        let topic = format!("{base}/persons");
        device.state("Tracked persons", "tracked", topic, persons);
        device
    }

    /// Adds a number that changes in both directions. An unknown one has no message.
    fn state(&mut self, name: &str, entity: &str, topic: String, value: Option<u64>) {
        let config = json!({ "state_class": "measurement", "icon": "mdi:account-group" });
        self.announce(name, entity, &topic, &config, true);
        if let Some(value) = value {
            self.retained.insert(topic, value.to_string());
        }
    }

    /// Adds a number that only grows.
    fn total(&mut self, name: &str, entity: &str, topic: String, value: u64, config: &Value) {
        let mut config = config.clone();
        config["state_class"] = json!("total_increasing");
        self.announce(name, entity, &topic, &config, false);
        self.retained.insert(topic, value.to_string());
    }

    fn announce(
        &mut self,
        name: &str,
        entity: &str,
        topic: &str,
        config: &Value,
        is_current: bool,
    ) {
        let Some(prefix) = &self.publisher.options.discovery_prefix else {
            return;
        };
        let id = format!("{}_count_{entity}", self.id);
        let version = env!("CARGO_PKG_VERSION");
        let mut availability = vec![json!({ "topic": self.publisher.topic("counts/status") })];
        if is_current {
            availability.push(json!({ "topic": self.availability }));
        }
        let mut config = config.clone();
        config["name"] = json!(name);
        config["state_topic"] = json!(topic);
        config["unique_id"] = json!(id);
        config["availability_mode"] = json!("all");
        config["availability"] = json!(availability);
        config["device"] = json!({
            "identifiers": [self.id],
            "name": self.name,
            "manufacturer": "Lookdown",
            "sw_version": version,
        });
        config["origin"] = json!({ "name": "Lookdown", "sw_version": version });
        let topic = format!("{prefix}/sensor/{id}/config");
        self.retained.insert(topic, config.to_string());
    }
}

/// Returns the messages that turn the published state into the wanted one.
fn changes(published: &Retained, wanted: &Retained) -> Vec<Message> {
    let gone = published
        .keys()
        .filter(|topic| !wanted.contains_key(*topic));
    let new = wanted
        .iter()
        .filter(|(topic, payload)| published.get(*topic) != Some(*payload));
    gone.map(|topic| Message::forget(topic.clone()))
        .chain(new.map(|(topic, payload)| Message::retained(topic.clone(), payload.clone())))
        .collect()
}

#[cfg(test)]
mod tests;

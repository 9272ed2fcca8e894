//! Publishes the counts of `lookdown count`: totals, occupancy and dwell times, with their
//! announcements to Home Assistant.
//!
//! The numbers of a camera or a site: their topics, and the IDs of their entities.

mod events;
#[cfg(test)]
mod tests;

use std::{
    collections::BTreeMap,
    future::Future,
    path::PathBuf,
    pin::{Pin, pin},
    time::Duration,
};

use jiff::Timestamp;
use lookdown_common::ServerClient;
use lookdown_count::Snapshot;
use rumqttc::Publish;
use serde_json::{Value, json};
use tokio::{
    sync::{mpsc, watch},
    time::{Instant, sleep_until},
};

use self::events::{
    Event, EventImage, announcements, config_topics, event_topic, events, floor_alert,
    request_images,
};
use super::{
    Broker,
    discovery::{self, BINARY_SENSOR, OFFLINE, ONLINE, RetainedTopics, SENSOR},
    session::{Connector, Message, Session, SessionError},
    topics::{Topics, level},
};

/// Most images of events that wait. Further ones are not requested.
const IMAGES: usize = 8;

/// The broker of the counts, and the settings of the messages.
#[derive(Debug, Clone, PartialEq)]
pub struct CountsOptions {
    /// The broker.
    pub broker: Broker,
    /// PEM file of the authorities of a broker with TLS. `None` trusts those of the system.
    pub authorities: Option<PathBuf>,
    /// The prefix of all topics.
    pub topic_prefix: String,
    /// The prefix of the topics of Home Assistant. `None` disables discovery.
    pub discovery_prefix: Option<String>,
    /// Time after the connection until retained topics of unknown cameras, lines, zones and sites
    /// are withdrawn.
    pub unknown_for: Duration,
    /// Shortest time between two images of events of a camera. `None` publishes none.
    pub image_every: Option<Duration>,
}

/// Publishes counts.
pub struct CountsPublisher {
    topics: Topics,
    options: CountsOptions,
    connector: Connector,
    snapshots: watch::Receiver<Snapshot>,
    /// The server, which has the images of events.
    server: ServerClient,
}

/// The retained messages: payloads by topic.
type Retained = BTreeMap<String, String>;

impl CountsPublisher {
    /// Creates a publisher that is not connected yet.
    ///
    /// # Errors
    /// If the authorities cannot be used.
    pub fn new(
        options: CountsOptions,
        snapshots: watch::Receiver<Snapshot>,
        server: ServerClient,
    ) -> anyhow::Result<Self> {
        Ok(Self {
            connector: Connector::new(
                options.broker.clone(),
                options.authorities.as_deref(),
                "lookdown-count",
            )?,
            topics: Topics::new(&options.topic_prefix, options.discovery_prefix.as_deref()),
            options,
            snapshots,
            server,
        })
    }

    /// Publishes until the counts end, and then publishes the status "offline".
    pub async fn run(self) {
        let (wanted, events) = mpsc::channel(IMAGES);
        let (sender, images) = mpsc::channel(1);
        let (server, every) = (self.server.clone(), self.options.image_every);
        let topics = self.topics.clone();
        let requesting = async {
            if let Some(every) = every {
                request_images(server, topics, every, events, sender).await;
            }
        };
        tokio::join!(self.publish(wanted, images), requesting);
    }

    /// Publishes in one session after the other. `wanted` receives the events, and `images` has
    /// their images.
    async fn publish(
        mut self,
        wanted: mpsc::Sender<Event>,
        mut images: mpsc::Receiver<EventImage>,
    ) {
        let mut snapshots = self.snapshots.clone();
        let mut stop = pin!(async move { while snapshots.changed().await.is_ok() {} });
        let will = self.status(OFFLINE);
        loop {
            let session = tokio::select! {
                session = self.connector.session(&will) => session,
                () = &mut stop => return,
            };
            let ended = self.serve(session, stop.as_mut(), &wanted, &mut images);
            let Err(error) = ended.await else {
                return;
            };
            self.connector.lost(&error);
        }
    }

    fn status(&self, status: &'static str) -> Message {
        Message::retained(self.topics.counts("status"), status)
    }

    /// Publishes every change until the session or the counts end.
    async fn serve(
        &mut self,
        mut session: Session,
        mut stop: Pin<&mut impl Future<Output = ()>>,
        wanted: &mpsc::Sender<Event>,
        images: &mut mpsc::Receiver<EventImage>,
    ) -> Result<(), SessionError> {
        session.publish([self.status(ONLINE)]).await?;
        let birth = self.topics.birth();
        let filters = ["cameras/#", "sites/#"].map(|rest| self.topics.counts(rest));
        session
            .subscribe(birth.clone().into_iter().chain(filters))
            .await?;
        let mut published = Retained::new();
        let mut before = self.snapshots.borrow().clone();
        let mut unknown = RetainedTopics::default();
        let connected = Instant::now();
        let mut withdraw_at = Some(connected + self.options.unknown_for);
        loop {
            let snapshot = self.snapshots.borrow_and_update().clone();
            let retained = self.retained(&snapshot);
            session.publish(changes(&published, &retained)).await?;
            published = retained;
            for event in events(&before, &snapshot) {
                let topic = event_topic(&self.topics, &event.camera);
                let body = event.body.to_string().into();
                session.publish([Message::passing(topic, body)]).await?;
                // Without room, the event has no image.
                let _ = wanted.try_send(event);
            }
            before = snapshot;
            tokio::select! {
                message = session.next() => {
                    let message = message?;
                    if birth.as_ref() == Some(&message.topic) && message.payload == ONLINE {
                        published.clear();
                    } else if withdraw_at.is_some() || !message.retain {
                        let answer = self.compare(&message, &published, &mut unknown);
                        session.publish(answer).await?;
                    }
                }
                () = sleep_until(withdraw_at.unwrap_or(connected)), if withdraw_at.is_some() => {
                    withdraw_at = None;
                    session.publish(self.withdrawals(&mut unknown, &published)).await?;
                }
                Some(EventImage { topics, jpeg }) = images.recv() => {
                    let jpeg = bytes::Bytes::from(jpeg);
                    let copies = topics.into_iter();
                    let copies = copies.map(|topic| Message::passing(topic, jpeg.clone()));
                    session.publish(copies).await?;
                }
                Ok(()) = self.snapshots.changed() => {}
                () = &mut stop => return session.close(self.status(OFFLINE)).await,
            }
        }
    }

    /// Compares a message of the broker with the published state. Notes retained topics, and
    /// returns the message that corrects an availability.
    fn compare(
        &self,
        message: &Publish,
        published: &Retained,
        unknown: &mut RetainedTopics,
    ) -> Option<Message> {
        let (owner, rest) = Owner::from_topic(self.topics.below_counts(&message.topic)?)?;
        // The echo of a message that removes a topic.
        if message.payload.is_empty() {
            return None;
        }
        let availability = self.topics.counts(&owner.availability());
        let own = published.get(&availability);
        if message.retain {
            let is_new = unknown.note(&owner.path(), Some(rest));
            return (is_new && own.is_none()).then(|| Message::retained(availability, OFFLINE));
        }
        let is_offline = rest == AVAILABILITY && message.payload == OFFLINE;
        match own {
            // Another companion has this camera or site.
            None if !is_offline => unknown.keep(&owner.path()),
            // Another companion does not have it.
            Some(own) if is_offline && own == ONLINE => {
                return Some(Message::retained(availability, ONLINE));
            }
            _ => {}
        }
        None
    }

    /// Returns the messages that remove the noted topics that are not published, with the
    /// announcements of their entities. Forgets the noted topics.
    fn withdrawals(&self, unknown: &mut RetainedTopics, published: &Retained) -> Vec<Message> {
        let mut topics = Vec::new();
        for (path, parts) in unknown.take() {
            let first = format!("{path}/{AVAILABILITY}");
            let Some((owner, _)) = Owner::from_topic(&first) else {
                continue;
            };
            let numbers = parts.iter().filter_map(|part| Number::from_topic(part));
            let numbers = numbers.flat_map(Number::with_companions);
            for number in numbers.chain([Number::Persons]) {
                topics.push(self.state_topic(owner, number));
                topics.extend(self.config_topic(owner, number));
            }
            topics.push(self.topics.counts(&first));
            if let Owner::Camera(name) = owner {
                topics.push(self.topics.counts(&owner.attributes()));
                topics.extend(config_topics(&self.topics, &self.device(owner, name)));
            }
        }
        let gone = topics
            .into_iter()
            .filter(|topic| !published.contains_key(topic));
        gone.map(Message::forget).collect()
    }

    fn state_topic(&self, owner: Owner<'_>, number: Number<'_>) -> String {
        let topic = format!("{}/{}", owner.path(), number.topic());
        self.topics.counts(&topic)
    }

    fn device<'a>(&self, owner: Owner<'_>, name: &'a str) -> discovery::Device<'a> {
        discovery::Device {
            id: format!("{}_{}", level(&self.options.topic_prefix), owner.device()),
            name,
        }
    }

    fn config_topic(&self, owner: Owner<'_>, number: Number<'_>) -> Option<String> {
        let id = self.device(owner, "").entity_id(&number.entity());
        self.topics.config(number.component(), &id)
    }

    /// Returns all messages that the broker is to retain.
    fn retained(&self, snapshot: &Snapshot) -> Retained {
        let mut retained = Retained::new();
        for camera in &snapshot.cameras {
            let name = level(&camera.name);
            let owner = Owner::Camera(&name);
            let events = self.device(owner, &camera.name);
            let has_images = self.options.image_every.is_some();
            retained.extend(announcements(&self.topics, &events, has_images));
            let mut device = Device::new(self, owner, &camera.name, camera.persons, &mut retained);
            let since = camera.too_low_since_ms.map(Timestamp::from_millisecond);
            let since = since.and_then(Result::ok).map(|time| time.to_string());
            let [low, high] = [0, 1].map(|end| camera.bar.map(|bar| bar[end]));
            let mut attributes =
                json!({ "persons_high": high, "persons_low": low, "too_low_since": since });
            if let Some(alerts) = &camera.floor_alerts {
                attributes["floor_alerts"] = alerts.iter().map(floor_alert).collect();
                device.floor_alert(!alerts.is_empty());
            }
            device.attributes(&attributes);
            for line in &camera.lines {
                let (of, direction) = (level(&line.line), level(&line.direction));
                let number = Number::Crossings {
                    line: &of,
                    direction: &direction,
                };
                let shown = format!("{} {}", line.line, line.direction);
                device.total(&shown, number, line.crossings, &json!({}));
            }
            for zone in &camera.zones {
                let name = level(&zone.zone);
                let [persons, entries, dwell] = Number::for_zone(&name);
                let shown = |what: &str| format!("{what} {}", zone.zone);
                device.state(&shown("Tracked persons in"), persons, zone.persons);
                device.total(&shown("Entries into"), entries, zone.entries, &json!({}));
                let duration = json!({ "device_class": "duration", "unit_of_measurement": "s" });
                let seconds = zone.person_ms / 1000;
                device.total(&shown("Dwell time in"), dwell, seconds, &duration);
            }
        }
        for site in &snapshot.sites {
            let name = level(&site.name);
            let shown = format!("Site {}", site.name);
            let owner = Owner::Site(&name);
            Device::new(self, owner, &shown, site.persons, &mut retained);
        }
        retained
    }
}

/// The entities of a camera or a site.
struct Device<'a> {
    publisher: &'a CountsPublisher,
    owner: Owner<'a>,
    name: &'a str,
    retained: &'a mut Retained,
}

impl<'a> Device<'a> {
    /// A device with its availability and the number of its persons.
    fn new(
        publisher: &'a CountsPublisher,
        owner: Owner<'a>,
        name: &'a str,
        persons: Option<u64>,
        retained: &'a mut Retained,
    ) -> Self {
        let availability = publisher.topics.counts(&owner.availability());
        let is_known = if persons.is_some() { ONLINE } else { OFFLINE };
        retained.insert(availability, is_known.to_owned());
        let mut device = Self {
            publisher,
            owner,
            name,
            retained,
        };
        device.state("Tracked persons", Number::Persons, persons);
        device
    }

    /// Adds the attributes of the number of persons.
    fn attributes(&mut self, attributes: &Value) {
        let topic = self.publisher.topics.counts(&self.owner.attributes());
        self.retained.insert(topic, attributes.to_string());
    }

    /// Adds a number that changes in both directions. An unknown one has no message.
    fn state(&mut self, name: &str, number: Number<'_>, value: Option<u64>) {
        let config = json!({ "state_class": "measurement", "icon": "mdi:account-group" });
        self.announce(name, number, &config, true);
        if let Some(value) = value {
            let topic = self.publisher.state_topic(self.owner, number);
            self.retained.insert(topic, value.to_string());
        }
    }

    /// Adds the state of the floor alert.
    fn floor_alert(&mut self, is_on: bool) {
        let number = Number::FloorAlert;
        let config = json!({ "device_class": "safety" });
        self.announce("Someone on the floor", number, &config, false);
        let topic = self.publisher.state_topic(self.owner, number);
        let state = if is_on { "ON" } else { "OFF" };
        self.retained.insert(topic, state.to_owned());
    }

    /// Adds a number that only grows.
    fn total(&mut self, name: &str, number: Number<'_>, value: u64, config: &Value) {
        let mut config = config.clone();
        config["state_class"] = json!("total_increasing");
        self.announce(name, number, &config, false);
        let topic = self.publisher.state_topic(self.owner, number);
        self.retained.insert(topic, value.to_string());
    }

    fn announce(&mut self, name: &str, number: Number<'_>, config: &Value, is_current: bool) {
        let (publisher, owner) = (self.publisher, self.owner);
        let topics = &publisher.topics;
        let own = is_current.then(|| topics.counts(&owner.availability()));
        let availability = [topics.counts("status")].into_iter().chain(own);
        let mut config = config.clone();
        config["name"] = json!(name);
        config["state_topic"] = json!(publisher.state_topic(owner, number));
        if let (Owner::Camera(_), Number::Persons | Number::FloorAlert) = (owner, number) {
            config["json_attributes_topic"] = json!(topics.counts(&owner.attributes()));
        }
        let device = publisher.device(owner, self.name);
        let entity = number.entity();
        let announcement =
            device.announcement(topics, number.component(), &entity, availability, config);
        self.retained.extend(announcement);
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

/// The topic below that of an owner with its availability.
const AVAILABILITY: &str = "availability";

/// The owner of numbers, by the level of its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Owner<'a> {
    Camera(&'a str),
    Site(&'a str),
}

impl<'a> Owner<'a> {
    /// Recognizes an owner by its path. Returns the rest of the topic, too.
    fn from_topic(topic: &'a str) -> Option<(Self, &'a str)> {
        let (kind, rest) = topic.split_once('/')?;
        let (name, rest) = rest.split_once('/')?;
        match kind {
            "cameras" => Some((Self::Camera(name), rest)),
            "sites" => Some((Self::Site(name), rest)),
            _ => None,
        }
    }

    /// The path of its topics below `counts`.
    fn path(self) -> String {
        match self {
            Self::Camera(name) => format!("cameras/{name}"),
            Self::Site(name) => format!("sites/{name}"),
        }
    }

    /// The topic of its availability, below `counts`.
    fn availability(self) -> String {
        format!("{}/{AVAILABILITY}", self.path())
    }

    /// The topic of the attributes of its number of persons, below `counts`.
    fn attributes(self) -> String {
        format!("{}/attributes", self.path())
    }

    /// The name of its device in Home Assistant, after the prefix of the topics.
    fn device(self) -> String {
        match self {
            Self::Camera(name) => name.to_owned(),
            Self::Site(name) => format!("site_{name}"),
        }
    }
}

/// A number that is published, by the levels of names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Number<'a> {
    Persons,
    /// On or off: someone is on the floor of a camera.
    FloorAlert,
    Crossings {
        line: &'a str,
        direction: &'a str,
    },
    ZonePersons {
        zone: &'a str,
    },
    Entries {
        zone: &'a str,
    },
    DwellSeconds {
        zone: &'a str,
    },
}

impl<'a> Number<'a> {
    /// Recognizes a number by its topic below that of its owner.
    fn from_topic(topic: &'a str) -> Option<Self> {
        let levels: Vec<_> = topic.split('/').collect();
        match levels[..] {
            ["persons"] => Some(Self::Persons),
            ["floor_alert"] => Some(Self::FloorAlert),
            ["lines", line, direction] => Some(Self::Crossings { line, direction }),
            ["zones", zone, "persons"] => Some(Self::ZonePersons { zone }),
            ["zones", zone, "entries"] => Some(Self::Entries { zone }),
            ["zones", zone, "dwell_seconds"] => Some(Self::DwellSeconds { zone }),
            _ => None,
        }
    }

    /// The numbers that exist only together with this one.
    fn with_companions(self) -> Vec<Self> {
        match self {
            Self::Persons | Self::FloorAlert | Self::Crossings { .. } => vec![self],
            Self::ZonePersons { zone } | Self::Entries { zone } | Self::DwellSeconds { zone } => {
                Self::for_zone(zone).to_vec()
            }
        }
    }

    /// The numbers of a zone.
    fn for_zone(zone: &'a str) -> [Self; 3] {
        [
            Self::ZonePersons { zone },
            Self::Entries { zone },
            Self::DwellSeconds { zone },
        ]
    }

    /// Its topic below that of its owner.
    fn topic(self) -> String {
        match self {
            Self::Persons => "persons".to_owned(),
            Self::FloorAlert => "floor_alert".to_owned(),
            Self::Crossings { line, direction } => format!("lines/{line}/{direction}"),
            Self::ZonePersons { zone } => format!("zones/{zone}/persons"),
            Self::Entries { zone } => format!("zones/{zone}/entries"),
            Self::DwellSeconds { zone } => format!("zones/{zone}/dwell_seconds"),
        }
    }

    /// The component of its entity.
    fn component(self) -> &'static str {
        match self {
            Self::FloorAlert => BINARY_SENSOR,
            _ => SENSOR,
        }
    }

    /// The ID of its entity within the device of its owner.
    fn entity(self) -> String {
        match self {
            Self::Persons => "count_tracked".to_owned(),
            Self::FloorAlert => "count_floor_alert".to_owned(),
            Self::Crossings { line, direction } => format!("count_line_{line}_{direction}"),
            Self::ZonePersons { zone } => format!("count_tracked_in_{zone}"),
            Self::Entries { zone } => format!("count_entries_{zone}"),
            Self::DwellSeconds { zone } => format!("count_dwell_{zone}"),
        }
    }
}

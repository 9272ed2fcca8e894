//! Publishes results to the broker: the subscription to the results, the queue, and the time
//! without a broker.

use std::{num::NonZeroUsize, path::PathBuf, sync::Arc, time::Duration};

use jiff::Timestamp;
use lookdown_common::OwnCameras;
use lookdown_detect::fairness::Client;
use lookdown_tracking::taught::NumberWithBar;
use rumqttc::Publish;
use tokio::{
    sync::{
        broadcast::{self, error::RecvError},
        mpsc,
    },
    time::{Instant, MissedTickBehavior, interval, sleep, sleep_until},
};

use super::{
    Broker,
    cameras::{self, Cameras},
    discovery::{Discovery, OFFLINE, ONLINE},
    images::{CameraImage, Images},
    session::{Connector, Message, Session, SessionError},
    switches::Switches,
    topics::Topics,
};
use crate::{
    metrics::Metrics,
    reference_counts::ReferenceCounts,
    results::{self, FollowedPersons, Headline, ListenError, ResultStore, StoredReport},
    views::Views,
};

/// Most reports that wait for the broker. When the queue is full, the oldest report is not sent.
const QUEUE: usize = 64;
/// Pause before the next attempt to listen to the results.
const LISTEN_PAUSE: Duration = Duration::from_secs(1);

/// Shortest time between two messages of the whole state. Any client of the broker can ask for it.
const BIRTH_PAUSE: Duration = Duration::from_secs(10);

/// Interval of the checks for followed numbers, for views and for switches.
const NUMBER_CHECK: Duration = Duration::from_secs(1);

/// Interval of the checks for cameras that another server with the same result store has removed.
const REMOVAL_CHECK: Duration = Duration::from_mins(1);

/// The broker to publish to, and the settings of the messages.
#[derive(Debug, Clone, PartialEq)]
pub struct MqttOptions {
    /// The broker.
    pub broker: Broker,
    /// PEM file of the authorities that may issue the certificate of a broker with TLS. `None`
    /// trusts those of the system.
    pub authorities: Option<PathBuf>,
    /// The prefix of all topics.
    pub topic_prefix: String,
    /// The prefix of the topics of Home Assistant. `None` disables discovery.
    pub discovery_prefix: Option<String>,
    /// Most cameras that are published.
    pub max_cameras: NonZeroUsize,
    /// Time without a person until occupancy is off.
    pub hold: Duration,
    /// Shortest time between two images of a camera. `None` publishes no images.
    pub image_every: Option<Duration>,
    /// The parts of the announcements that the settings give.
    pub discovery: Discovery,
}

/// Publishes the results.
pub struct Publisher {
    connector: Connector,
    publication: Publication,
}

/// The results that are published, and their source.
struct Publication {
    options: MqttOptions,
    results: Arc<dyn ResultStore>,
    counted: FollowedPersons,
    references: Arc<ReferenceCounts>,
    metrics: Arc<Metrics>,
    views: Arc<Views>,
    topics: Topics,
    /// The cameras of `lookdown run`, which have a switch for detection.
    switched: Option<Arc<crate::cameras::Cameras>>,
}

type Queue = broadcast::Receiver<Arc<StoredReport>>;

impl Publisher {
    /// Creates a publisher that is not connected yet.
    ///
    /// # Errors
    /// If the authorities cannot be used.
    pub fn new(
        options: MqttOptions,
        results: Arc<dyn ResultStore>,
        counted: FollowedPersons,
        references: Arc<ReferenceCounts>,
        metrics: Arc<Metrics>,
        views: Arc<Views>,
    ) -> anyhow::Result<Self> {
        let connector = Connector::new(
            options.broker.clone(),
            options.authorities.as_deref(),
            "lookdown",
        )?;
        let publication = Publication {
            topics: Topics::new(&options.topic_prefix, options.discovery_prefix.as_deref()),
            options,
            results,
            counted,
            references,
            metrics,
            views,
            switched: None,
        };
        Ok(Self {
            connector,
            publication,
        })
    }

    /// Publishes a switch for the detection of each of these cameras.
    pub fn add_switches(&mut self, cameras: Arc<crate::cameras::Cameras>) {
        self.publication.switched = Some(cameras);
    }

    /// Publishes until the results end, and then publishes the status "offline".
    pub async fn run(self) {
        let (sender, queue) = broadcast::channel(QUEUE);
        // One image waits for the broker, and the next one is drawn after it.
        let (image_sender, images) = mpsc::channel(1);
        let publication = &self.publication;
        let drawing = async {
            if let Some(every) = publication.options.image_every {
                let images = Images {
                    results: Arc::clone(&publication.results),
                    views: Arc::clone(&publication.views),
                    of: publication.options.discovery.images.clone(),
                    every,
                };
                images.draw(image_sender).await;
            }
        };
        tokio::join!(
            hear(&publication.results, sender),
            drawing,
            publication.publish(self.connector, queue, images)
        );
    }
}

impl Publication {
    /// Publishes in one session after the other, until the reports end.
    async fn publish(
        &self,
        mut connector: Connector,
        mut queue: Queue,
        mut images: mpsc::Receiver<CameraImage>,
    ) {
        let own = self.switched.as_ref().map(|cameras| cameras.own.clone());
        let own = own.unwrap_or_default();
        let mut cameras = Cameras::new(
            self.topics.clone(),
            self.options.discovery.clone(),
            self.options.hold,
            self.options.max_cameras,
            own,
        );
        // If the result store does not answer now, a camera is published with its next report.
        for report in self.results.latest_of_all().await.unwrap_or_default() {
            let age = Timestamp::now().duration_since(report.report.received_at);
            let age = Duration::try_from(age).unwrap_or_default();
            let number = self.headline(&report).await;
            cameras.update(&report, number, age, Instant::now());
        }
        let will = self.status(OFFLINE);
        let mut switches = self.switched.clone().map(|cameras| {
            let (topics, discovery) = (self.topics.clone(), self.options.discovery.clone());
            Switches::new(topics, discovery, cameras)
        });
        loop {
            let session = tokio::select! {
                session = connector.session(&will) => session,
                () = self.skip_reports(&mut cameras, &mut queue) => return,
            };
            self.metrics.mqtt_connected.set(1);
            let switches = switches.as_mut();
            let ended = self.serve(session, &mut cameras, switches, &mut queue, &mut images);
            let ended = ended.await;
            self.metrics.mqtt_connected.set(0);
            let Err(error) = ended else { return };
            connector.lost(&error);
        }
    }

    fn status(&self, status: &'static str) -> Message {
        Message::retained(self.topics.status(), status)
    }

    /// Updates the cameras from the reports until they end, without sending anything.
    async fn skip_reports(&self, cameras: &mut Cameras, queue: &mut Queue) {
        loop {
            match queue.recv().await {
                Ok(report) => {
                    let number = self.headline(&report).await;
                    cameras.update(&report, number, Duration::ZERO, Instant::now());
                    self.metrics.mqtt_reports_dropped.inc();
                }
                Err(RecvError::Lagged(count)) => self.metrics.mqtt_reports_dropped.inc_by(count),
                Err(RecvError::Closed) => return,
            }
        }
    }

    /// Publishes the current state and then each report, until the reports end.
    async fn serve(
        &self,
        mut session: Session,
        cameras: &mut Cameras,
        mut switches: Option<&mut Switches>,
        queue: &mut Queue,
        images: &mut mpsc::Receiver<CameraImage>,
    ) -> Result<(), SessionError> {
        session.publish([self.status(ONLINE)]).await?;
        let birth = self.topics.birth();
        let topics = [self.topics.status()].into_iter().chain(birth);
        let mut removals = self.results.listeners().removals();
        let mut checks = interval(REMOVAL_CHECK);
        let mut numbers = interval(NUMBER_CHECK);
        numbers.set_missed_tick_behavior(MissedTickBehavior::Delay);
        cameras.begin_connection(Instant::now());
        let mut filters: Vec<_> = topics.chain(self.topics.camera_filters()).collect();
        if let Some(switches) = &mut switches {
            let unknown_for = cameras::unknown_for(&self.options.discovery);
            switches.begin_connection(Instant::now(), unknown_for);
            filters.extend(self.topics.switch_filters());
        }
        session.subscribe(filters).await?;
        session.publish(self.without_removed(cameras).await).await?;
        session.publish(cameras.all(Instant::now())).await?;
        let mut next_state: Option<Instant> = None;
        let mut not_before = Instant::now();
        loop {
            let next_change = cameras.next_change();
            tokio::select! {
                message = session.next() => {
                    let message = message?;
                    if switches.as_mut().is_some_and(|switches| switches.note(&message)) {
                        continue;
                    }
                    if let Some(answer) = cameras.compare(&message.topic, &message.payload, message.retain) {
                        session.publish([answer]).await?;
                    } else if self.is_birth(&message) {
                        next_state.get_or_insert(not_before);
                    } else if message.topic == self.topics.status() && message.payload == OFFLINE {
                        // Another client says otherwise, such as the will of a replica that has
                        // ended.
                        session.publish([self.status(ONLINE)]).await?;
                    }
                }
                () = sleep_until(next_state.unwrap_or(not_before)), if next_state.is_some() => {
                    next_state = None;
                    not_before = Instant::now() + BIRTH_PAUSE;
                    session.publish(cameras.all(Instant::now())).await?;
                    if let Some(switches) = &mut switches {
                        switches.publish_again();
                    }
                }
                () = sleep_until(next_change.unwrap_or(not_before)), if next_change.is_some() => {
                    session.publish(cameras.expire(Instant::now())).await?;
                }
                Ok(()) = removals.changed() => {
                    session.publish(self.without_removed(cameras).await).await?;
                }
                _ = numbers.tick() => {
                    session.publish(self.followed(cameras)).await?;
                    session.publish(cameras.update_views(&self.views)).await?;
                    if let Some(switches) = &mut switches {
                        session.publish(switches.update(Instant::now()).await).await?;
                    }
                }
                _ = checks.tick() => {
                    session.publish(self.without_removed(cameras).await).await?;
                }
                Some(image) = images.recv() => {
                    session.publish(cameras.image(image)).await?;
                }
                report = queue.recv() => match report {
                    Ok(report) => {
                        let number = self.headline(&report).await;
                        let messages = cameras.update(&report, number, Duration::ZERO, Instant::now());
                        let is_one_too_many = messages.is_empty();
                        let published = session.publish(messages).await;
                        let counter = if is_one_too_many || published.is_err() {
                            &self.metrics.mqtt_reports_dropped
                        } else {
                            &self.metrics.mqtt_reports_sent
                        };
                        counter.inc();
                        published?;
                    }
                    Err(RecvError::Lagged(count)) => self.metrics.mqtt_reports_dropped.inc_by(count),
                    Err(RecvError::Closed) => return session.close(self.status(OFFLINE)).await,
                },
            }
        }
    }

    /// Returns the headline number after a report: that of the frame if the store does not answer.
    async fn headline(&self, report: &StoredReport) -> NumberWithBar {
        // A paused camera is unavailable, whatever its number.
        let own = OwnCameras::default();
        let (counted, references) = (&self.counted, &self.references);
        let headline =
            Headline::for_latest(&*self.results, report, &own, counted, references).await;
        let number = headline.ok().and_then(|headline| headline.number);
        number.unwrap_or_else(|| NumberWithBar::untaught(report.report.persons))
    }

    /// Updates what changes without a report: the followed numbers, and cameras that are paused.
    /// Returns the messages.
    fn followed(&self, cameras: &mut Cameras) -> Vec<Message> {
        let mut messages = cameras.pause(Instant::now());
        for camera in cameras.available() {
            // Without a number, and with a taught one, the next report decides.
            if self.references.number(&camera).is_none()
                && let Some(persons) = self.counted.at(&camera)
            {
                let number = NumberWithBar::untaught(persons);
                messages.extend(cameras.set_number(&camera, number, Instant::now()));
            }
        }
        messages
    }

    /// Removes the cameras that the result store has no longer. Returns the messages.
    async fn without_removed(&self, cameras: &mut Cameras) -> Vec<Message> {
        // Without an answer, nothing is known to be removed.
        let stored = self.results.cameras().await;
        stored.map_or(Vec::new(), |stored| cameras.retain(&stored))
    }

    /// Returns whether Home Assistant says that it has started: it needs the whole state then.
    fn is_birth(&self, message: &Publish) -> bool {
        let birth = self.topics.birth();
        birth.is_some_and(|topic| message.topic == topic && message.payload == ONLINE)
    }
}

/// Forwards the results to the queue until they end. Never waits for the broker.
async fn hear(results: &Arc<dyn ResultStore>, queue: broadcast::Sender<Arc<StoredReport>>) {
    loop {
        match results
            .listeners()
            .listen(&Client::Only, results::Cameras::All)
        {
            Ok(mut listening) => {
                while let Some(report) = listening.next().await {
                    // The receiver of the queue is dropped when the publisher ends.
                    let _ = queue.send(report);
                }
            }
            Err(ListenError::Ended) => return,
            // A permit is released when another listener leaves.
            Err(
                ListenError::Full { .. }
                | ListenError::ShareUsed { .. }
                | ListenError::Unreachable(_),
            ) => {
                sleep(LISTEN_PAUSE).await;
            }
        }
    }
}

#[cfg(test)]
mod tests;

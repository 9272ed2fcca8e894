//! From the results to the broker: who listens, what waits, and what happens while there is no broker.

use std::{num::NonZeroUsize, path::PathBuf, sync::Arc, time::Duration};

use rumqttc::Publish;
use tokio::{
    sync::broadcast::{self, error::RecvError},
    time::{Instant, sleep},
};
use uuid::Uuid;

use super::{
    Broker,
    cameras::Cameras,
    discovery::{OFFLINE, ONLINE},
    message::Message,
    session::{Session, SessionError},
    topics::Topics,
};
use crate::{
    metrics::Metrics,
    results::{self, ListenError, ResultStore, StoredReport},
    tls::{ClientTls, TlsError},
};

/// Reports that may wait for the broker; with one more, the oldest is not sent.
const QUEUE: usize = 64;
/// Pauses before the broker is tried again.
const SHORTEST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_mins(1);
/// A connection that has lasted as long was a good one.
const STEADY: Duration = Duration::from_secs(10);

/// To whom what is published, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct MqttOptions {
    /// The broker.
    pub broker: Broker,
    /// File of the authorities that a broker with TLS may have its certificate from, PEM; `None` for
    /// those that the system trusts.
    pub authorities: Option<PathBuf>,
    /// What all topics begin with.
    pub topic_prefix: String,
    /// What those of Home Assistant begin with; `None` for no discovery.
    pub discovery_prefix: Option<String>,
    /// Cameras that are published at most.
    pub max_cameras: NonZeroUsize,
}

/// Publishes what the results tell.
pub struct Publisher {
    options: MqttOptions,
    results: Arc<dyn ResultStore>,
    metrics: Arc<Metrics>,
    tls: Option<ClientTls>,
    topics: Topics,
    /// Nobody else's: a broker drops the first of two clients with the same.
    client_id: String,
}

type Queue = broadcast::Receiver<Arc<StoredReport>>;

impl Publisher {
    /// Connects to nobody yet.
    ///
    /// # Errors
    /// [`TlsError`] when the authorities cannot be used.
    pub fn new(
        options: MqttOptions,
        results: Arc<dyn ResultStore>,
        metrics: Arc<Metrics>,
    ) -> Result<Self, TlsError> {
        let tls = options.broker.has_tls.then(|| {
            let authorities = options.authorities.as_deref();
            ClientTls::new("mqtt.authorities", authorities)
        });
        Ok(Self {
            tls: tls.transpose()?,
            topics: Topics::new(&options.topic_prefix, options.discovery_prefix.as_deref()),
            client_id: format!("lookdown-{}", Uuid::new_v4().simple()),
            options,
            results,
            metrics,
        })
    }

    /// Publishes until the results end, and then says so to the broker.
    pub async fn run(self) {
        let (sender, queue) = broadcast::channel(QUEUE);
        tokio::join!(hear(&self.results, sender), self.publish(queue));
    }

    /// Keeps a connection, again and again.
    async fn publish(&self, mut queue: Queue) {
        let mut cameras = Cameras::new(self.topics.clone(), self.options.max_cameras);
        // Whose place does not answer now is heard of with its next report.
        for report in self.results.latest_of_all().await.unwrap_or_default() {
            cameras.hear(&report);
        }
        let mut pause = SHORTEST_PAUSE;
        let mut is_told = false;
        loop {
            let opened = tokio::select! {
                opened = self.open() => opened,
                () = self.go_without(&mut cameras, &mut queue) => return,
            };
            let ended = match opened {
                Ok(session) => {
                    tracing::info!(
                        "publishing to the broker {} (mqtt.url)",
                        self.options.broker
                    );
                    is_told = false;
                    let began = Instant::now();
                    self.metrics.mqtt_connected.set(1);
                    let ended = self.serve(session, &mut cameras, &mut queue).await;
                    self.metrics.mqtt_connected.set(0);
                    if began.elapsed() >= STEADY {
                        pause = SHORTEST_PAUSE;
                    }
                    ended
                }
                Err(error) => Err(error),
            };
            let Err(error) = ended else { return };
            if !is_told {
                let broker = &self.options.broker;
                tracing::warn!("nothing is published to the broker {broker} (mqtt.url): {error}");
            }
            is_told = true;
            tokio::select! {
                () = sleep(pause) => {}
                () = self.go_without(&mut cameras, &mut queue) => return,
            }
            pause = (2 * pause).min(LONGEST_PAUSE);
        }
    }

    async fn open(&self) -> Result<Session, SessionError> {
        let broker = &self.options.broker;
        Session::open(
            broker,
            self.tls.as_ref(),
            &self.client_id,
            self.status(OFFLINE),
        )
        .await
    }

    fn status(&self, status: &'static str) -> Message {
        Message::retained(self.topics.status(), status)
    }

    /// Keeps up with the reports until they end; none of them is sent.
    async fn go_without(&self, cameras: &mut Cameras, queue: &mut Queue) {
        loop {
            match queue.recv().await {
                Ok(report) => {
                    cameras.hear(&report);
                    self.metrics.mqtt_reports_dropped.inc();
                }
                Err(RecvError::Lagged(count)) => self.metrics.mqtt_reports_dropped.inc_by(count),
                Err(RecvError::Closed) => return,
            }
        }
    }

    /// Publishes all that is known, and then what comes, to the end of the reports.
    async fn serve(
        &self,
        mut session: Session,
        cameras: &mut Cameras,
        queue: &mut Queue,
    ) -> Result<(), SessionError> {
        session.publish([self.status(ONLINE)]).await?;
        let birth = self.topics.birth();
        let topics = [self.topics.status()].into_iter().chain(birth);
        session.subscribe(topics).await?;
        session.publish(cameras.all()).await?;
        loop {
            tokio::select! {
                said = session.next() => {
                    let messages = self.answer(&said?, cameras);
                    session.publish(messages).await?;
                }
                report = queue.recv() => match report {
                    Ok(report) => {
                        let messages = cameras.hear(&report);
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

    /// What is to be said to what others have said: everything to a Home Assistant that has started,
    /// and that we are there to whoever says otherwise, such as the will of a replica that has ended.
    fn answer(&self, said: &Publish, cameras: &Cameras) -> Vec<Message> {
        let is_of = |topic: &str, payload: &str| said.topic == topic && said.payload == payload;
        if is_of(&self.topics.status(), OFFLINE) {
            return vec![self.status(ONLINE)];
        }
        if self
            .topics
            .birth()
            .is_some_and(|birth| is_of(&birth, ONLINE))
        {
            return cameras.all();
        }
        Vec::new()
    }
}

/// Hands on what the results tell, to their end. Never waits for the broker.
async fn hear(results: &Arc<dyn ResultStore>, queue: broadcast::Sender<Arc<StoredReport>>) {
    loop {
        match results.listeners().listen(results::Cameras::All) {
            Ok(mut listening) => {
                while let Some(report) = listening.next().await {
                    // Who reads the queue goes when it ends.
                    let _ = queue.send(report);
                }
            }
            Err(ListenError::Ended) => return,
            // There is a place again when somebody has gone.
            Err(ListenError::Full { .. }) => sleep(SHORTEST_PAUSE).await,
        }
    }
}

#[cfg(test)]
mod tests;

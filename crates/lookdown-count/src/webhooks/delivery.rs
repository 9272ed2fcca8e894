//! Delivers messages: each receiver has a task, so that one never slows another.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
    time::Duration,
};

use base64::{Engine as _, engine::general_purpose::STANDARD};
use jiff::Timestamp;
use lookdown_common::{ClientError, HttpClient, LogOnce, ServerClient, text::with_causes};
use reqwest::{Method, StatusCode, Url, header::CONTENT_TYPE};
use serde_json::{Value, json};
use tokio::{
    sync::mpsc::{self, error::TrySendError},
    task::spawn_blocking,
    time::sleep,
};
use tokio_util::task::AbortOnDropHandle;

use super::{SigningKey, Webhook};
use crate::{
    event_image::latest_image,
    metrics::Metrics,
    store::{Store, write::Message},
};

/// Most messages that wait for a receiver.
const QUEUE: usize = 256;
/// Longest time of an attempt.
const TIMEOUT: Duration = Duration::from_secs(15);
/// Greatest age of a message that gets an image, seconds. The latest image of the camera would show
/// another time.
const IMAGE_AGE_S: i64 = 10;
/// Pauses before further attempts.
const PAUSES: [Duration; 4] = [
    Duration::from_secs(2),
    Duration::from_secs(15),
    Duration::from_mins(2),
    Duration::from_mins(10),
];

/// The receivers.
pub(crate) struct Deliveries {
    /// By the digest of the webhook. Webhooks with one URL share a receiver.
    receivers: BTreeMap<String, mpsc::Sender<Message>>,
    store: Store,
    metrics: Arc<Metrics>,
    _tasks: Vec<AbortOnDropHandle<()>>,
}

/// A receiver of messages.
struct Receiver {
    client: HttpClient,
    key: SigningKey,
    url: Url,
    /// The scheme, the host and the port: the path may be a secret.
    address: String,
    log: LogOnce,
    images: Images,
}

/// The images of messages.
#[derive(Clone)]
struct Images {
    server: ServerClient,
    /// The digests of the webhooks whose messages have an image.
    webhooks: Arc<BTreeSet<String>>,
}

/// The outcome of an attempt.
enum Attempt {
    Delivered,
    /// The receiver wants no messages.
    Refused(String),
    Failed(String),
}

impl Deliveries {
    /// Starts the tasks. `waiting` are the messages of the store.
    pub(crate) fn start(
        webhooks: &[Webhook],
        waiting: Vec<Message>,
        server: &ServerClient,
        store: &Store,
        metrics: &Arc<Metrics>,
    ) -> Result<Self, ClientError> {
        let client = HttpClient::new(None)?;
        let with_image = webhooks.iter().filter(|webhook| webhook.with_image);
        let images = Images {
            server: server.clone(),
            webhooks: Arc::new(with_image.map(Webhook::digest).collect()),
        };
        let mut receivers = BTreeMap::new();
        let mut of_urls = BTreeMap::<&Url, mpsc::Sender<Message>>::new();
        let mut tasks = Vec::new();
        for webhook in webhooks {
            if let Some(sender) = of_urls.get(&webhook.url) {
                receivers.insert(webhook.digest(), sender.clone());
                continue;
            }
            let (sender, queue) = mpsc::channel(QUEUE);
            let receiver = Receiver {
                client: client.clone(),
                key: webhook.key.clone(),
                url: webhook.url.clone(),
                address: webhook.url.origin().ascii_serialization(),
                log: LogOnce::default(),
                images: images.clone(),
            };
            let (store, metrics) = (store.clone(), Arc::clone(metrics));
            let task = tokio::spawn(receiver.run(queue, store, metrics));
            tasks.push(AbortOnDropHandle::new(task));
            of_urls.insert(&webhook.url, sender.clone());
            receivers.insert(webhook.digest(), sender);
        }
        let deliveries = Self {
            receivers,
            store: store.clone(),
            metrics: Arc::clone(metrics),
            _tasks: tasks,
        };
        deliveries.send(waiting);
        Ok(deliveries)
    }

    /// Queues messages that are in the store. A message that cannot be queued is dropped.
    pub(crate) fn send(&self, messages: Vec<Message>) {
        for message in messages {
            let id = message.id.clone();
            let sent = match self.receivers.get(&message.webhook) {
                Some(receiver) => receiver.try_send(message),
                // The webhook was removed from the settings.
                None => Err(TrySendError::Closed(message)),
            };
            if sent.is_err() {
                self.metrics.webhooks_dropped.inc();
                spawn_blocking({
                    let store = self.store.clone();
                    move || remove(&store, &id)
                });
            }
        }
    }
}

impl Receiver {
    async fn run(
        mut self,
        mut queue: mpsc::Receiver<Message>,
        store: Store,
        metrics: Arc<Metrics>,
    ) {
        while let Some(message) = queue.recv().await {
            if self.deliver(&message).await {
                metrics.webhooks_delivered.inc();
            } else {
                metrics.webhooks_dropped.inc();
            }
            let (store, id) = (store.clone(), message.id);
            // A task that panicked is logged by the panic hook.
            let _ = spawn_blocking(move || remove(&store, &id)).await;
        }
    }

    /// Returns true if the message was delivered.
    async fn deliver(&mut self, message: &Message) -> bool {
        let mut pauses = PAUSES.into_iter();
        let body = self.images.added_to(message).await;
        loop {
            let problem = match self.attempt(&message.id, &body).await {
                Attempt::Delivered => {
                    self.log.clear();
                    return true;
                }
                Attempt::Refused(problem) => {
                    if self.log.should_log(&problem) {
                        tracing::warn!("{problem}; the message is dropped");
                    }
                    return false;
                }
                Attempt::Failed(problem) => problem,
            };
            let pause = pauses.next();
            if self.log.should_log(&problem) {
                tracing::warn!("{problem}");
            }
            match pause {
                Some(pause) => sleep(pause).await,
                None => return false,
            }
        }
    }

    async fn attempt(&self, id: &str, body: &str) -> Attempt {
        let timestamp_s = Timestamp::now().as_second();
        let signature = self.key.sign(id, timestamp_s, body);
        let request = self
            .client
            .request(Method::POST, self.url.clone())
            .timeout(TIMEOUT)
            .header(CONTENT_TYPE, "application/json")
            .header("webhook-id", id)
            .header("webhook-timestamp", timestamp_s)
            .header("webhook-signature", signature)
            .body(body.to_owned());
        let address = &self.address;
        match self.client.send(request).await {
            Ok(response) if response.status().is_success() => Attempt::Delivered,
            Ok(response) if response.status() == StatusCode::GONE => Attempt::Refused(format!(
                "the webhook at {address} answered 410 Gone: remove it from the settings"
            )),
            Ok(response) => Attempt::Failed(format!(
                "the webhook at {address} answered {}: check its URL and its secret",
                response.status()
            )),
            Err(error) => Attempt::Failed(format!(
                "the webhook at {address} cannot be reached: {}: start it, or correct its URL",
                with_causes(&error)
            )),
        }
    }
}

impl Images {
    /// Returns the body of a message, with the latest image of its camera if the webhook wants one
    /// and the message is recent. Images are not stored.
    async fn added_to(&self, message: &Message) -> String {
        let age_s = Timestamp::now().as_second() - message.created_s;
        if !self.webhooks.contains(&message.webhook) || age_s > IMAGE_AGE_S {
            return message.body.clone();
        }
        let Ok(mut body) = serde_json::from_str::<Value>(&message.body) else {
            return message.body.clone();
        };
        let camera = body["data"]["camera"].as_str().unwrap_or_default();
        let image = latest_image(&self.server, camera).await;
        body["data"]["image"] = image.map_or(
            Value::Null,
            |jpeg| json!({ "media_type": "image/jpeg", "base64": STANDARD.encode(jpeg) }),
        );
        body.to_string()
    }
}

fn remove(store: &Store, id: &str) {
    if let Err(problem) = store.remove_message(id) {
        tracing::warn!("{problem}");
    }
}

#[cfg(test)]
mod tests;

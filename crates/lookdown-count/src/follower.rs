//! Follows the reports of the server: passes them to the counter, and stores its sums in intervals.

use std::{sync::Arc, time::Duration};

use jiff::Timestamp;
use lookdown_common::{Backoff, LogOnce, ServerClient, retry_after};
use parking_lot::Mutex;
use reqwest::{Response, StatusCode};
use tokio::{
    sync::watch,
    task::spawn_blocking,
    time::{Instant, sleep, sleep_until, timeout},
};

use crate::{
    calibrations::Calibrations,
    counter::{Accepted, Counter},
    event_parser::{Event, EventParser, TooLarge},
    metrics::Metrics,
    now::Now,
    report::ReceivedReport,
    scene::Batch,
    snapshot::Snapshot,
    store::{Store, write::Message},
    webhooks::{Conditions, Deliveries},
};

/// Pauses between connections.
const FIRST_PAUSE: Duration = Duration::from_millis(500);
const LONGEST_PAUSE: Duration = Duration::from_secs(15);
/// Interval of the evaluation of time: silent cameras, and the current counts.
const TICK: Duration = Duration::from_secs(1);
/// Interval of the removal of old sums.
const EXPIRY: Duration = Duration::from_mins(30);

/// Everything that the reports change.
pub(crate) struct Follower {
    pub(crate) client: ServerClient,
    pub(crate) counter: Arc<Mutex<Counter>>,
    pub(crate) calibrations: Calibrations,
    pub(crate) store: Store,
    pub(crate) conditions: Conditions,
    pub(crate) deliveries: Deliveries,
    pub(crate) metrics: Arc<Metrics>,
    pub(crate) snapshots: watch::Sender<Snapshot>,
    pub(crate) commit_every: Duration,
    pub(crate) retention: Duration,
    /// Messages that are not stored yet.
    pub(crate) messages: Vec<Message>,
    pub(crate) next_commit: Instant,
    pub(crate) next_expiry: Instant,
    /// True once the companion is to end. Reports are abandoned between transactions only.
    pub(crate) stop: watch::Receiver<bool>,
}

impl Follower {
    /// Follows the reports until the companion is to end, and stores the last sums.
    pub(crate) async fn run(&mut self) {
        let mut backoff = Backoff::new(FIRST_PAUSE, LONGEST_PAUSE);
        let mut log = LogOnce::default();
        // The counts of the store are there before the server answers.
        self.tick().await;
        while !*self.stop.borrow() {
            let began = Instant::now();
            let error = self.follow(&mut log).await;
            self.metrics.connected.set(0);
            if !error.message.is_empty() && log.should_log(&error.message) {
                tracing::warn!("{}", error.message);
            }
            backoff.reset_if_stable(began.elapsed());
            let pause = error.retry_after.unwrap_or_else(|| backoff.next_pause());
            let until = Instant::now() + pause;
            while Instant::now() < until && !*self.stop.borrow() {
                self.tick().await;
                let next = until.min(Instant::now() + TICK);
                let mut stop = self.stop.clone();
                tokio::select! {
                    () = sleep_until(next) => {}
                    () = stopped(&mut stop) => {}
                }
            }
        }
        self.commit().await;
    }

    /// Follows one connection until it ends.
    async fn follow(&mut self, log: &mut LogOnce) -> StreamError {
        let client = self.client.clone();
        let last_event = self.counter.lock().last_event;
        let mut stop = self.stop.clone();
        let opened = tokio::select! {
            opened = EventStream::open(&client, last_event) => opened,
            () = stopped(&mut stop) => return StreamError::stopped(),
        };
        let mut stream = match opened {
            Ok(stream) => stream,
            Err(error) => return error,
        };
        self.metrics.connected.set(1);
        log.clear();
        tracing::info!("following the reports of {}", client.address());
        let mut next_tick = Instant::now();
        loop {
            tokio::select! {
                event = stream.next() => match event {
                    Ok(event) => if let Err(error) = self.accept(&event).await { return error },
                    Err(error) => return error,
                },
                () = stopped(&mut stop) => return StreamError::stopped(),
                () = sleep_until(next_tick.min(self.next_commit)) => {
                    if Instant::now() >= next_tick {
                        next_tick = Instant::now() + TICK;
                        self.tick().await;
                    }
                }
            }
            let is_urgent = self.counter.lock().is_urgent || !self.messages.is_empty();
            if is_urgent || Instant::now() >= self.next_commit {
                self.commit().await;
            }
        }
    }

    /// Counts the report of an event.
    async fn accept(&mut self, event: &Event) -> Result<(), StreamError> {
        let skipped = |reason: &str| {
            self.metrics
                .reports_skipped
                .with_label_values(&[reason])
                .inc();
        };
        let Some(id) = event.id else {
            skipped("malformed");
            return Ok(());
        };
        let report = serde_json::from_slice::<ReceivedReport>(&event.data).ok();
        let Some(report) = report.filter(ReceivedReport::has_valid_names) else {
            skipped("malformed");
            return Ok(());
        };
        let definition = self.counter.lock().definition(&report.camera);
        let key = report.definition_key();
        let known = definition.filter(|definition| definition.key == key);
        let definition = if let Some(definition) = known {
            definition
        } else {
            let mut stop = self.stop.clone();
            let updated = tokio::select! {
                updated = self.calibrations.update(&self.client, &self.store, &key) => updated,
                () = stopped(&mut stop) => return Err(StreamError::stopped()),
            };
            updated.map_err(StreamError::new)?;
            self.calibrations.definition(key)
        };
        let mut counter = self.counter.lock();
        let now = Now::read();
        match counter.accept(id, &report, &definition, now) {
            Accepted::Counted(crossings) => {
                self.metrics.reports.inc();
                if let Some(scene) = counter.scene_of(&report.camera) {
                    let at_ms = report.at_ms(definition.site.is_some());
                    let camera = &report.camera;
                    let messages = self
                        .conditions
                        .for_report(id, camera, at_ms, now, &crossings, scene);
                    self.messages.extend(messages);
                }
            }
            Accepted::Dropped(reason) => skipped(reason.label()),
        }
        Ok(())
    }

    /// Evaluates what follows from the time alone, and stores what is due.
    async fn tick(&mut self) {
        let now_ms = Timestamp::now().as_millisecond();
        self.messages.extend(self.conditions.for_time(now_ms));
        let snapshot = self.counter.lock().snapshot(now_ms);
        self.snapshots.send_if_modified(|last| {
            let is_changed = *last != snapshot;
            *last = snapshot;
            is_changed
        });
        if Instant::now() >= self.next_commit || !self.messages.is_empty() {
            self.commit().await;
        }
        if Instant::now() >= self.next_expiry {
            self.next_expiry = Instant::now() + EXPIRY;
            self.counter.lock().forget_silent(now_ms);
            let age_ms = i64::try_from(self.retention.as_millis()).unwrap_or(i64::MAX);
            let store = self.store.clone();
            let expired = spawn_blocking(move || store.expire(now_ms.saturating_sub(age_ms))).await;
            if let Ok(Err(problem)) = expired {
                tracing::warn!("{problem}");
            }
        }
    }

    /// Stores all sums. Repeats a failed transaction until it succeeds: meanwhile no report is
    /// read, so that memory stays bounded. The server sends those reports again.
    pub(crate) async fn commit(&mut self) {
        let batch = self.counter.lock().take_batch();
        let messages = std::mem::take(&mut self.messages);
        self.next_commit = Instant::now() + self.commit_every;
        let held = self.conditions.take_changed();
        if batch.is_none() && messages.is_empty() && held.is_none() {
            return;
        }
        let batch = batch.unwrap_or_else(|| {
            let counter = self.counter.lock();
            Batch {
                last_event: counter.last_event,
                totals: counter.stored_totals.clone(),
                ..Batch::default()
            }
        });
        let batch = Arc::new((batch, messages, held));
        let mut backoff = Backoff::new(FIRST_PAUSE, LONGEST_PAUSE);
        let mut log = LogOnce::default();
        loop {
            let store = self.store.clone();
            let shared = Arc::clone(&batch);
            let committed = spawn_blocking(move || {
                let (batch, messages, held) = &*shared;
                store.commit(batch, messages, held.as_ref())
            })
            .await;
            match committed {
                Ok(Ok(())) => break,
                Ok(Err(problem)) => {
                    self.metrics.commits_failed.inc();
                    let problem = problem.to_string();
                    if log.should_log(&problem) {
                        tracing::error!("{problem}: free space, or correct counts.path");
                    }
                }
                // A task that panicked is logged by the panic hook.
                Err(_) => self.metrics.commits_failed.inc(),
            }
            if *self.stop.borrow() {
                tracing::error!(
                    "the last sums are not stored: the server sends their reports again"
                );
                return;
            }
            sleep(backoff.next_pause()).await;
        }
        self.counter.lock().stored(&batch.0);
        if log.clear() {
            tracing::info!("the store is written again");
        }
        self.deliveries.send(batch.1.clone());
    }
}

/// Waits until the companion is to end.
async fn stopped(stop: &mut watch::Receiver<bool>) {
    // A sender that is gone means the same.
    let _ = stop.wait_for(|stop| *stop).await;
}

/// Longest time for the head of the response.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(20);
/// Longest silence: the server sends a comment every 15 seconds.
const SILENCE: Duration = Duration::from_secs(45);

/// The reason why a stream has ended or could not be opened.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
struct StreamError {
    pub(crate) message: String,
    /// The time of `Retry-After`.
    pub(crate) retry_after: Option<Duration>,
}

/// An open stream of events.
struct EventStream<'a> {
    client: &'a ServerClient,
    response: Response,
    parser: EventParser,
}

impl<'a> EventStream<'a> {
    /// Opens the stream after the event with this ID.
    pub(crate) async fn open(client: &'a ServerClient, after: u64) -> Result<Self, StreamError> {
        let mut request = client
            .get(client.route(["events"]))
            .header("accept", "text/event-stream");
        if after > 0 {
            request = request.header("last-event-id", after);
        }
        let response = match timeout(CONNECT_TIMEOUT, client.send(request)).await {
            Ok(Ok(response)) => response,
            Ok(Err(error)) => return Err(StreamError::new(client.failure(&error))),
            Err(_) => {
                let address = client.address();
                return Err(StreamError::new(format!(
                    "the server {address} does not answer in 20 s: check upstream.url"
                )));
            }
        };
        if response.status() != StatusCode::OK {
            let retry_after = retry_after(response.headers());
            return Err(StreamError {
                message: client.refusal(response).await,
                retry_after,
            });
        }
        Ok(Self {
            client,
            response,
            parser: EventParser::default(),
        })
    }

    /// Returns the next event. Cancel-safe.
    pub(crate) async fn next(&mut self) -> Result<Event, StreamError> {
        loop {
            match self.parser.next_event() {
                Ok(Some(event)) => return Ok(event),
                Ok(None) => {}
                Err(TooLarge) => {
                    let address = self.client.address();
                    let message = format!("{address}: {TooLarge}: check upstream.url");
                    return Err(StreamError::new(message));
                }
            }
            match timeout(SILENCE, self.response.chunk()).await {
                Ok(Ok(Some(chunk))) => self.parser.push(&chunk),
                Ok(Ok(None)) => return Err(self.ended("has ended the stream")),
                Ok(Err(error)) => return Err(StreamError::new(self.client.failure(&error.into()))),
                Err(_) => return Err(self.ended("was silent for 45 s")),
            }
        }
    }

    fn ended(&self, reason: &str) -> StreamError {
        StreamError::new(format!("the server {} {reason}", self.client.address()))
    }
}

impl StreamError {
    /// Returns the end that the companion itself causes.
    pub(crate) fn stopped() -> Self {
        Self::new(String::new())
    }

    fn new(message: String) -> Self {
        Self {
            message,
            retry_after: None,
        }
    }
}

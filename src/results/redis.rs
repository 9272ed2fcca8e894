//! Reports in a Redis that several servers share, so that each server answers for every camera.
//!
//! A server holds two connections, independent of the number of listeners: one for queries and
//! reports, one that subscribes to the cameras that have listeners here. Redis assigns the IDs, so
//! they are the same on every server. While Redis is unreachable, reports wait in a bounded outbox,
//! and detection does not wait for them.
//!
//! Sends reports from the outbox to Redis, one after the other. Each report is stored atomically
//! and exactly once: after a lost answer, Redis recognizes the report by its number.

mod address;
mod reading;
mod session;
mod shared;
#[cfg(test)]
mod tests;

use std::{io, num::NonZeroUsize, sync::Arc, time::Duration};

use async_trait::async_trait;
use jiff::Timestamp;
use lookdown_common::text::one_line;
use lookdown_detect::fairness::Client;
use lookdown_http::request_id::new_id;
use redis::{RedisResult, Script, aio::MultiplexedConnection};
use tokio::{task::JoinSet, time::timeout};

pub use address::{RedisAddress, RedisAddressError};
pub use shared::RedisOptions;

use self::{
    address::{Connector, TIMEOUT},
    reading::Reader,
    shared::{Followed, Keys, Link, Outbox, PendingReport, Shared, is_refusal},
};
use super::{
    Cameras, ListenError, Listeners, Listening, NewReport, ReportId, ResultLimits, ResultStore,
    ResultUse, StoreHealth, StoredImage, StoredReport, Unreachable,
};
use crate::{annotated_image::StoredFrame, metrics::Metrics};

/// Longest time that the shutdown waits for reports that Redis has not stored yet.
const LAST_WAIT: Duration = Duration::from_secs(2);

/// Keeps reports in a Redis, within limits.
pub struct RedisResults {
    shared: Arc<Shared>,
    /// Background tasks, aborted when this is dropped.
    _tasks: JoinSet<()>,
}

impl RedisResults {
    /// Starts a store that connects, and reconnects, in the background. Needs a tokio runtime.
    ///
    /// # Errors
    /// If the address needs TLS and TLS cannot be used.
    pub fn start(
        options: RedisOptions,
        limits: ResultLimits,
        metrics: Arc<Metrics>,
    ) -> anyhow::Result<Self> {
        let shared = Arc::new(Shared {
            keys: Keys::new(&options.key_prefix, options.address.database()),
            followed: Followed::default(),
            connector: Connector::new(options.address.clone())?,
            options,
            link: Link::new(metrics.results_store_up.clone()),
            outbox: Outbox::new(metrics.results_dropped.clone()),
            stored: metrics.results_stored.clone(),
            listeners: Arc::new(Listeners::new(limits.max_listeners, metrics)),
            limits,
        });
        let mut tasks = JoinSet::new();
        tasks.spawn(session::keep(Arc::clone(&shared)));
        tasks.spawn(send(Arc::clone(&shared)));
        Ok(Self {
            shared,
            _tasks: tasks,
        })
    }

    /// Sends a query if there is a connection.
    async fn ask<T>(
        &self,
        question: impl for<'a> AsyncFnOnce(Reader<'a>) -> RedisResult<T>,
    ) -> Result<T, Unreachable> {
        let line = self.shared.link.line()?;
        let reader = Reader::new(&line.connection, &self.shared.keys);
        let outcome = timeout(TIMEOUT, question(reader)).await;
        let outcome =
            outcome.unwrap_or_else(|_| Err(io::Error::from(io::ErrorKind::TimedOut).into()));
        self.shared.link.outcome(&line, outcome)
    }
}

#[async_trait]
impl ResultStore for RedisResults {
    fn publish(&self, report: NewReport, image: Option<StoredFrame>) {
        self.shared.outbox.push(report, image);
    }

    async fn latest(&self, camera: &str) -> Result<Option<Arc<StoredReport>>, Unreachable> {
        self.ask(async |mut reader| reader.latest(camera).await)
            .await
    }

    async fn latest_of_all(&self) -> Result<Vec<Arc<StoredReport>>, Unreachable> {
        let most = self.shared.limits.max_cameras;
        self.ask(async |mut reader| reader.latest_of_all(most).await)
            .await
    }

    async fn cameras(&self) -> Result<Vec<String>, Unreachable> {
        let most = self.shared.limits.max_cameras;
        self.ask(async |mut reader| reader.cameras(most).await)
            .await
    }

    async fn delete(&self, camera: &str) -> Result<bool, Unreachable> {
        let deleted = self.ask(async |mut reader| reader.delete(camera).await);
        let is_deleted = deleted.await?;
        if is_deleted {
            self.shared.listeners.note_removal();
        }
        Ok(is_deleted)
    }

    async fn delete_image(&self, camera: &str) -> Result<(), Unreachable> {
        self.ask(async |mut reader| reader.delete_image(camera).await)
            .await
    }

    async fn since(
        &self,
        cameras: &Cameras,
        after: ReportId,
        most: NonZeroUsize,
    ) -> Result<Vec<Arc<StoredReport>>, Unreachable> {
        self.ask(async |mut reader| reader.since(cameras, after, most).await)
            .await
    }

    async fn image(&self, camera: &str) -> Result<Option<Arc<StoredImage>>, Unreachable> {
        self.ask(async |mut reader| reader.image(camera).await)
            .await
    }

    async fn listen(&self, client: &Client, to: Cameras) -> Result<Listening, ListenError> {
        let Shared { link, followed, .. } = &*self.shared;
        let listening = self.shared.listeners.listen(client, to.clone())?;
        let is_followed = async {
            tokio::select! {
                biased;
                () = followed.contains(&to) => Ok(listening),
                problem = link.lost() => Err(Unreachable(problem).into()),
            }
        };
        timeout(TIMEOUT, is_followed).await.unwrap_or_else(|_| {
            let problem = "it has not confirmed a subscription in time".to_owned();
            Err(Unreachable(problem).into())
        })
    }

    fn listeners(&self) -> &Arc<Listeners> {
        &self.shared.listeners
    }

    async fn usage(&self) -> Result<ResultUse, Unreachable> {
        self.ask(async |mut reader| reader.usage().await).await
    }

    fn health(&self) -> StoreHealth {
        let Shared { link, outbox, .. } = &*self.shared;
        StoreHealth {
            problem: link.problem(),
            waiting: outbox.count(),
        }
    }

    async fn flush(&self) {
        let Shared { link, outbox, .. } = &*self.shared;
        let sent = async {
            tokio::select! {
                () = outbox.is_empty() => {}
                _ = link.lost() => {}
            }
        };
        if timeout(LAST_WAIT, sent).await.is_err() || outbox.count() > 0 {
            tracing::warn!(
                "{} reports were not kept: Redis did not store them in time",
                outbox.count()
            );
        }
    }
}

/// The script that stores a report in Redis.
const RECORD: &str = concat!(
    include_str!("redis/forget.lua"),
    include_str!("redis/record.lua")
);

/// Sends reports for as long as the server runs. The first of consecutive refusals is logged.
async fn send(shared: Arc<Shared>) {
    let sender = Sender {
        script: Script::new(RECORD),
        id: new_id().into_bytes(),
        shared: &shared,
    };
    let mut last_was_refused = false;
    let mut number = 0;
    loop {
        let pending = shared.outbox.first().await;
        // Increases also beyond the numbers of servers that have ended, so that theirs are
        // forgotten first.
        number = now_micros().max(number + 1);
        let refusal = sender.send(&pending, number).await.err();
        if let Some(refusal) = &refusal
            && !last_was_refused
        {
            let address = &shared.options.address;
            let refusal = one_line(refusal);
            tracing::warn!("Redis at {address} refuses reports: {refusal}");
        }
        last_was_refused = refusal.is_some();
        if !last_was_refused {
            shared.stored.inc();
        }
        shared.outbox.done(last_was_refused);
    }
}

struct Sender<'a> {
    script: Script,
    /// Identifies this server.
    id: [u8; 16],
    shared: &'a Shared,
}

impl Sender<'_> {
    /// Sends a report until Redis has answered. Fails only with a refusal.
    async fn send(&self, pending: &PendingReport, number: u64) -> RedisResult<()> {
        loop {
            let line = self.shared.link.next_line().await;
            let outcome = self.record(line.connection.clone(), pending, number).await;
            match outcome {
                Err(error) if !is_refusal(&error) => {
                    // Waits for the next connection.
                    let _ = self.shared.link.outcome(&line, Err::<(), _>(error));
                }
                outcome => return outcome,
            }
        }
    }

    async fn record(
        &self,
        mut connection: MultiplexedConnection,
        PendingReport { report, image }: &PendingReport,
        number: u64,
    ) -> RedisResult<()> {
        let (keys, limits) = (&self.shared.keys, &self.shared.limits);
        let mut call = self.script.prepare_invoke();
        call.key(&keys.index()[..]).key(keys.key("senders"));
        call.arg(keys.prefix_of_cameras());
        call.arg(keys.prefix_of_images()).arg(&report.camera);
        call.arg(keys.channel(&Cameras::One(report.camera.clone())));
        call.arg(keys.channel(&Cameras::All));
        call.arg(&self.id[..]).arg(number);
        call.arg(report.received_at.to_string());
        call.arg(report.persons).arg(&report.json[..]);
        // An empty image means that there is none.
        let parts = image.as_ref().map(|it| [&it.jpeg[..], &it.sketch[..]]);
        let [frame, sketch] = parts.unwrap_or_default();
        call.arg(frame).arg(sketch);
        call.arg(report.bytes());
        for limit in [
            limits.max_cameras.get(),
            limits.history_per_camera.get(),
            limits.max_reports.get(),
            limits.max_bytes,
            limits.max_images.get(),
        ] {
            call.arg(limit);
        }
        call.arg(limits.max_age.as_secs());
        call.invoke_async(&mut connection).await
    }
}

fn now_micros() -> u64 {
    u64::try_from(Timestamp::now().as_microsecond()).unwrap_or_default()
}

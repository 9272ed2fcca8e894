//! Reports in a Redis that several servers share, so that each server answers for every camera.
//!
//! A server holds two connections, independent of the number of listeners: one for queries and
//! reports, one that subscribes to the cameras that have listeners here. Redis assigns the IDs, so
//! they are the same on every server. While Redis is unreachable, reports wait in a bounded outbox,
//! and detection does not wait for them.

mod address;
mod message;
mod outbox;
mod pushes;
mod reading;
mod sender;
mod session;
mod shared;
#[cfg(test)]
mod tests;

use std::{io, num::NonZeroUsize, sync::Arc, time::Duration};

use async_trait::async_trait;
use lookdown_detect::fairness::Client;
use redis::RedisResult;
use tokio::{task::JoinSet, time::timeout};

use self::{
    address::{Connector, TIMEOUT},
    outbox::Outbox,
    reading::Reader,
    shared::{Followed, Keys, Link, Shared},
};
pub use self::{
    address::{RedisAddress, RedisAddressError},
    shared::RedisOptions,
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
        tasks.spawn(sender::run(Arc::clone(&shared)));
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
        let reader = Reader {
            connection: line.connection.clone(),
            keys: &self.shared.keys,
        };
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

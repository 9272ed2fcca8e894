//! Keeps the connection to Redis, and reconnects when it is lost.
//!
//! Publishes to the listeners here the reports of all servers. A server subscribes to the channels
//! of the cameras that have listeners here, and to no others. A camera's channel may lose messages
//! while there is no connection: the next one reads them from the camera's stream.

use std::{
    collections::HashMap, convert::Infallible, io, iter, num::NonZeroUsize, sync::Arc,
    time::Duration,
};

use lookdown_common::{Backoff, LogOnce, text::one_line};
use redis::{PushInfo, PushKind, RedisError, RedisResult, Value, aio::MultiplexedConnection, pipe};
use tokio::time::{Instant, MissedTickBehavior, interval, sleep};

use super::{
    Shared,
    address::Pushes,
    reading::{Reader, parse_message},
};
use crate::results::{Cameras, ReportId};

const FIRST_PAUSE: Duration = Duration::from_millis(100);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// The shared connection, and the one that receives new reports.
struct Session {
    commands: MultiplexedConnection,
    news: (MultiplexedConnection, Pushes),
    /// The newest ID when it began.
    newest: ReportId,
}

/// Connects for as long as the server runs. A loss and a reconnection are logged once each.
pub(super) async fn keep(shared: Arc<Shared>) {
    let address = &shared.options.address;
    let mut backoff = Backoff::new(FIRST_PAUSE, LONGEST_PAUSE);
    let mut positions = Positions::new();
    let mut losses = LogOnce::default();
    for number in 1.. {
        let problem = match open(&shared).await {
            Err(error) => {
                shared.link.is_down(&error);
                one_line(&error)
            }
            Ok(session) => {
                let began = Instant::now();
                // Reports that wait for this connection are news to these listeners.
                for cameras in shared.listeners.cameras() {
                    positions.entry(cameras).or_insert(session.newest);
                }
                shared.link.is_up(session.commands, number);
                if losses.clear() {
                    tracing::info!("Redis at {address} answers again: reports are stored there");
                } else {
                    tracing::info!("reports are stored in Redis at {address}");
                }
                let problem = tokio::select! {
                    Err(error) = follow(&shared, session.news, &mut positions) => {
                        shared.link.is_down(&error);
                        one_line(&error)
                    }
                    problem = shared.link.lost() => problem,
                };
                shared.followed.clear();
                backoff.reset_if_stable(began.elapsed());
                problem
            }
        };
        // Whatever its reasons, a loss is logged once.
        if losses.should_log("lost") {
            tracing::warn!(
                "Redis at {address} does not answer ({problem}): detection continues, reports \
                 wait for it, and results cannot be read; trying again until it does"
            );
        }
        sleep(backoff.next_pause()).await;
    }
}

async fn open(shared: &Shared) -> RedisResult<Session> {
    let commands = shared.connector.connect().await?;
    Ok(Session {
        newest: Reader::new(&commands, &shared.keys).newest().await?,
        news: shared.connector.connect_for_pushes().await?,
        commands,
    })
}

/// Interval of the checks that Redis answers, and that every channel has a listener.
const CHECK_INTERVAL: Duration = Duration::from_secs(5);
/// Most missed reports per read.
const PAGE: usize = 32;
/// Most messages that are handled at once.
const BATCH: usize = 256;
/// Least time between two batches. A Redis that never stops sending cannot keep the thread busy.
const BETWEEN_BATCHES: Duration = Duration::from_millis(10);

/// The last report of each channel that was published here.
pub(super) type Positions = HashMap<Cameras, ReportId>;

/// Follows the channels until the connection is lost.
pub(super) async fn follow(
    shared: &Shared,
    (connection, mut pushes): (MultiplexedConnection, Pushes),
    positions: &mut Positions,
) -> RedisResult<Infallible> {
    positions.retain(|cameras, _| shared.listeners.has_listener_for(cameras));
    let mut changes = shared.listeners.arrivals();
    let [mut checks, mut batches] = [CHECK_INTERVAL, BETWEEN_BATCHES].map(|period| {
        let mut ticks = interval(period);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        ticks
    });
    let mut news = News {
        shared,
        connection,
        positions,
        channels: HashMap::new(),
    };
    let ended = pushes.ended();
    let follow = async {
        loop {
            tokio::select! {
                push = pushes.next() => {
                    news.publish(push.ok_or_else(lost)?);
                    for push in iter::from_fn(|| pushes.waiting()).take(BATCH) {
                        news.publish(push);
                    }
                    batches.tick().await;
                }
                _ = changes.changed() => news.subscribe().await?,
                _ = checks.tick() => news.check().await?,
            }
        }
    };
    tokio::select! {
        outcome = follow => outcome,
        () = ended.notified() => Err(lost()),
    }
}

/// The subscriptions of one connection.
struct News<'a> {
    shared: &'a Shared,
    connection: MultiplexedConnection,
    positions: &'a mut Positions,
    channels: HashMap<String, Cameras>,
}

impl News<'_> {
    /// Publishes a report that Redis has pushed.
    fn publish(&mut self, push: PushInfo) {
        let mut data = push.data.into_iter();
        let Some(Value::BulkString(channel)) = data.next() else {
            return;
        };
        let channel = String::from_utf8_lossy(&channel);
        let Some(cameras) = self.channels.get(&*channel) else {
            return;
        };
        if let (PushKind::SMessage, Some(Value::BulkString(report))) = (push.kind, data.next()) {
            let report = parse_message(report).map(Arc::new);
            let position = self.positions.entry(cameras.clone()).or_default();
            // A report may have been read from the stream before.
            if let Some(report) = report.filter(|report| report.id > *position) {
                *position = report.id;
                self.shared.listeners.publish_to(cameras, &report);
            }
        }
    }

    /// Subscribes to the channels of cameras that have their first listener.
    async fn subscribe(&mut self) -> RedisResult<()> {
        let wanted = self.shared.listeners.cameras().into_iter();
        let wanted = wanted.map(|cameras| (self.shared.keys.channel(&cameras), cameras));
        let missing = wanted.filter(|(channel, _)| !self.channels.contains_key(channel));
        let missing: Vec<_> = missing.collect();
        if missing.is_empty() {
            return Ok(());
        }
        let mut commands = pipe();
        for (channel, _) in &missing {
            // With one channel each, so that each has one reply.
            commands.cmd("SSUBSCRIBE").arg(channel).ignore();
        }
        let () = commands.query_async(&mut self.connection).await?;
        let newest = Reader::new(&self.connection, &self.shared.keys)
            .newest()
            .await?;
        for (channel, cameras) in missing {
            self.catch_up(&cameras, newest).await?;
            self.channels.insert(channel, cameras.clone());
            self.shared.followed.insert(cameras);
        }
        if self.channels.len() > 2 * self.shared.limits.max_listeners.get() {
            self.unsubscribe().await?;
        }
        Ok(())
    }

    /// Publishes what was missed since the last connection, if there are listeners from that time.
    /// Those that come later read everything until `newest` themselves.
    async fn catch_up(&mut self, cameras: &Cameras, newest: ReportId) -> RedisResult<()> {
        let position = self.positions.entry(cameras.clone()).or_insert(newest);
        // A Redis that has lost its data may have a lower ID than this position.
        *position = newest.min(*position);
        let page = NonZeroUsize::new(PAGE).unwrap_or(NonZeroUsize::MIN);
        let mut reader = Reader::new(&self.connection, &self.shared.keys);
        while *position < newest {
            let missed = reader.since(cameras, *position, page).await?;
            for report in &missed {
                *position = report.id;
                self.shared.listeners.publish_to(cameras, report);
            }
            if missed.is_empty() {
                break;
            }
        }
        Ok(())
    }

    /// Checks that Redis answers, and unsubscribes from channels without listeners. They are kept
    /// until then, as a client that polls comes back soon.
    async fn check(&mut self) -> RedisResult<()> {
        Reader::new(&self.connection, &self.shared.keys)
            .newest()
            .await?;
        self.unsubscribe().await?;
        self.subscribe().await
    }

    async fn unsubscribe(&mut self) -> RedisResult<()> {
        let (listeners, followed) = (&self.shared.listeners, &self.shared.followed);
        // A listener that comes at this moment finds its channel followed, and keeps it, or waits
        // until it is followed again.
        let left = followed.remove_unless(|cameras| listeners.has_listener_for(cameras));
        let mut commands = pipe();
        for cameras in left {
            let channel = self.shared.keys.channel(&cameras);
            commands.cmd("SUNSUBSCRIBE").arg(&channel).ignore();
            self.channels.remove(&channel);
            self.positions.remove(&cameras);
        }
        if commands.is_empty() {
            return Ok(());
        }
        commands.query_async(&mut self.connection).await
    }
}

fn lost() -> RedisError {
    let problem = "the connection for subscriptions has ended";
    io::Error::new(io::ErrorKind::ConnectionReset, problem).into()
}

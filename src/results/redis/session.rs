//! Keeps the connection to Redis, reconnects when it is lost, and publishes to the listeners here
//! the reports of all servers.

use std::{convert::Infallible, sync::Arc, time::Duration};

use redis::{RedisResult, aio::MultiplexedConnection, cmd, streams::StreamReadReply};
use tokio::time::{Instant, MissedTickBehavior, interval, sleep};

use super::{
    Shared,
    connect::TIMEOUT,
    reading::{Reader, entries},
};
use crate::{quoted::one_line, results::ReportId};

/// Time for which a blocking read waits for new reports.
const NEWS_WAIT: Duration = Duration::from_secs(5);
/// Most new reports per read.
const PAGE: usize = 32;
/// Least time between two reads. A Redis that does not wait cannot keep the thread busy.
const BETWEEN_READS: Duration = Duration::from_millis(10);
/// Pause before the second attempt to connect. Each pause is twice as long as the one before.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// The shared connection, and the one that waits for new reports.
struct Session {
    commands: MultiplexedConnection,
    news: MultiplexedConnection,
    newest: ReportId,
}

/// Connects for as long as the server runs. A loss and a reconnection are logged once each.
pub(super) async fn keep(shared: Arc<Shared>) {
    let address = &shared.options.address;
    let mut pause = FIRST_PAUSE;
    let mut heard = None;
    let mut loss_was_logged = false;
    for number in 1.. {
        let problem = match open(&shared).await {
            Err(error) => {
                shared.link.is_down(&error);
                one_line(&error)
            }
            Ok(session) => {
                let began = Instant::now();
                shared.link.is_up(session.commands, number);
                if loss_was_logged {
                    tracing::info!("Redis at {address} answers again: reports are stored there");
                    loss_was_logged = false;
                } else {
                    tracing::info!("reports are stored in Redis at {address}");
                }
                // A Redis that has lost its data may have a lower ID than this position.
                let mut position = heard.unwrap_or(session.newest).min(session.newest);
                let problem = tokio::select! {
                    Err(error) = follow(&shared, session.news, &mut position) => {
                        shared.link.is_down(&error);
                        one_line(&error)
                    }
                    problem = shared.link.lost() => problem,
                };
                heard = Some(position);
                if began.elapsed() > LONGEST_PAUSE {
                    pause = FIRST_PAUSE;
                }
                problem
            }
        };
        if !loss_was_logged {
            tracing::warn!(
                "Redis at {address} does not answer ({problem}): detection continues, reports \
                 wait for it, and results cannot be read; trying again until it does"
            );
            loss_was_logged = true;
        }
        sleep(pause).await;
        pause = LONGEST_PAUSE.min(2 * pause);
    }
}

async fn open(shared: &Shared) -> RedisResult<Session> {
    let commands = shared.connector.connect(TIMEOUT).await?;
    let mut reader = Reader {
        connection: commands.clone(),
        keys: &shared.keys,
    };
    Ok(Session {
        newest: reader.newest().await?,
        news: shared.connector.connect(NEWS_WAIT + TIMEOUT).await?,
        commands,
    })
}

/// Publishes the reports after `position` to the listeners, in order, and advances `position`.
async fn follow(
    shared: &Shared,
    mut connection: MultiplexedConnection,
    position: &mut ReportId,
) -> RedisResult<Infallible> {
    let mut reader = Reader {
        connection: connection.clone(),
        keys: &shared.keys,
    };
    let mut ticks = interval(BETWEEN_READS);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        let mut read = cmd("XREAD");
        read.arg("COUNT").arg(PAGE);
        read.arg("BLOCK").arg(NEWS_WAIT.as_secs() * 1000);
        let place = format!("{position}-0");
        read.arg("STREAMS").arg(shared.keys.reports()).arg(place);
        let news: Option<StreamReadReply> = read.query_async(&mut connection).await?;
        let news = news.into_iter().flat_map(|news| news.keys);
        let mut news = entries(news.flat_map(|stream| stream.ids).collect());
        let newest = news.last().map(|entry| entry.id);
        news.retain(|entry| shared.listeners.has_listener_for(&entry.camera));
        for report in reader.reports_at(news).await? {
            shared.listeners.tell(&report);
        }
        *position = newest.unwrap_or(*position);
    }
}

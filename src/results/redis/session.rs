//! Keeps the connection to Redis, makes it anew when it is lost, and tells whoever listens here of the
//! reports that any server publishes.

use std::{convert::Infallible, sync::Arc, time::Duration};

use redis::{
    AsyncConnectionConfig, RedisResult, aio::MultiplexedConnection, cmd, streams::StreamReadReply,
};
use tokio::time::{Instant, sleep};

use super::{
    Shared,
    reading::{Reader, entries},
};
use crate::results::ReportId;

/// Longest that Redis may take to let us in, and to answer anything.
const TIMEOUT: Duration = Duration::from_secs(2);
/// How long Redis holds a question for news before it answers that there are none.
const NEWS_WAIT: Duration = Duration::from_secs(5);
/// News that are fetched at a time.
const PAGE: usize = 32;
/// Between two attempts to connect; each pause is twice as long as the one before.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
const LONGEST_PAUSE: Duration = Duration::from_secs(5);

/// A connection for everybody, and one that waits for news.
struct Session {
    commands: MultiplexedConnection,
    news: MultiplexedConnection,
    newest: ReportId,
}

/// Connects, for as long as the server runs. Loss and return are logged once each.
pub(super) async fn keep(shared: Arc<Shared>) {
    let address = &shared.options.address;
    let mut pause = FIRST_PAUSE;
    let mut heard = None;
    let mut loss_was_told = false;
    for number in 1.. {
        let problem = match open(&shared).await {
            Err(error) => {
                shared.link.is_down(&error);
                error.to_string()
            }
            Ok(session) => {
                let began = Instant::now();
                shared.link.is_up(session.commands, number);
                if loss_was_told {
                    tracing::info!("Redis at {address} answers again: reports are kept there");
                    loss_was_told = false;
                } else {
                    tracing::info!("reports are kept in Redis at {address}");
                }
                // A Redis that has lost everything may also be behind.
                let mut position = heard.unwrap_or(session.newest).min(session.newest);
                let problem = tokio::select! {
                    Err(error) = follow(&shared, session.news, &mut position) => {
                        shared.link.is_down(&error);
                        error.to_string()
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
        if !loss_was_told {
            tracing::warn!(
                "Redis at {address} does not answer ({problem}): frames are looked at all the same, reports \
                 wait for it, and results cannot be read; trying again until it does"
            );
            loss_was_told = true;
        }
        sleep(pause).await;
        pause = LONGEST_PAUSE.min(2 * pause);
    }
}

async fn open(shared: &Shared) -> RedisResult<Session> {
    let client = shared.options.address.client();
    let connect = async |timeout| {
        let config = AsyncConnectionConfig::new()
            .set_connection_timeout(Some(TIMEOUT))
            .set_response_timeout(Some(timeout));
        client
            .get_multiplexed_async_connection_with_config(&config)
            .await
    };
    let commands = connect(TIMEOUT).await?;
    let mut reader = Reader {
        connection: commands.clone(),
        keys: &shared.keys,
    };
    Ok(Session {
        newest: reader.newest().await?,
        news: connect(NEWS_WAIT + TIMEOUT).await?,
        commands,
    })
}

/// Tells listeners of what comes after `position`, in order, and moves that on.
async fn follow(
    shared: &Shared,
    mut connection: MultiplexedConnection,
    position: &mut ReportId,
) -> RedisResult<Infallible> {
    let mut reader = Reader {
        connection: connection.clone(),
        keys: &shared.keys,
    };
    loop {
        let mut read = cmd("XREAD");
        read.arg("COUNT").arg(PAGE);
        read.arg("BLOCK").arg(NEWS_WAIT.as_secs() * 1000);
        let place = format!("{position}-0");
        read.arg("STREAMS").arg(shared.keys.reports()).arg(place);
        let news: Option<StreamReadReply> = read.query_async(&mut connection).await?;
        let news = news.into_iter().flat_map(|news| news.keys);
        let mut news = entries(news.flat_map(|stream| stream.ids).collect());
        let newest = news.last().map(|entry| entry.id);
        news.retain(|entry| shared.listeners.are_there_for(&entry.camera));
        for report in reader.reports_at(news).await? {
            shared.listeners.tell(&report);
        }
        *position = newest.unwrap_or(*position);
    }
}

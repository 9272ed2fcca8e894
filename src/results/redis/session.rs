//! Keeps the connection to Redis, and reconnects when it is lost.

use std::{sync::Arc, time::Duration};

use lookdown_common::{Backoff, LogOnce, text::one_line};
use redis::{RedisResult, aio::MultiplexedConnection};
use tokio::time::{Instant, sleep};

use super::{
    Shared,
    news::{self, Positions},
    pushes::Pushes,
    reading::Reader,
};
use crate::results::ReportId;

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
                    Err(error) = news::follow(&shared, session.news, &mut positions) => {
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
    let mut reader = Reader {
        connection: commands.clone(),
        keys: &shared.keys,
    };
    Ok(Session {
        newest: reader.newest().await?,
        news: shared.connector.connect_for_pushes().await?,
        commands,
    })
}

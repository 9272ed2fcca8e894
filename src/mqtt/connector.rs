//! The way to the broker: it opens one session after the other, with pauses between the attempts.

use std::{path::Path, time::Duration};

use lookdown_common::{Backoff, LogOnce};
use tokio::time::{Instant, sleep_until};
use uuid::Uuid;

use super::{
    Broker,
    session::{Message, Session, SessionError},
};
use crate::tls::ClientTls;

const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_mins(1);

/// A broker, and the time of the next attempt to connect to it.
pub(super) struct Connector {
    broker: Broker,
    tls: Option<ClientTls>,
    /// Unique, as a broker drops the first of two clients with the same ID.
    client_id: String,
    backoff: Backoff,
    log: LogOnce,
    next_attempt: Instant,
    /// The start of the current session.
    opened: Option<Instant>,
}

impl Connector {
    /// Creates a connector. The ID of the client starts with `client`.
    ///
    /// # Errors
    /// If the authorities cannot be used.
    pub(super) fn new(
        broker: Broker,
        authorities: Option<&Path>,
        client: &str,
    ) -> anyhow::Result<Self> {
        Ok(Self {
            tls: broker.tls(authorities)?,
            broker,
            client_id: format!("{client}-{}", Uuid::new_v4().simple()),
            backoff: Backoff::new(FIRST_PAUSE, LONGEST_PAUSE),
            log: LogOnce::default(),
            next_attempt: Instant::now(),
            opened: None,
        })
    }

    /// Returns the next session: tries until the broker accepts one. The broker publishes `will`
    /// if the session is lost. Cancel-safe: it may be dropped and called again.
    pub(super) async fn session(&mut self, will: &Message) -> Session {
        loop {
            sleep_until(self.next_attempt).await;
            let tls = self.tls.as_ref();
            match Session::open(&self.broker, tls, &self.client_id, will.clone()).await {
                Ok(session) => {
                    tracing::info!("publishing to the broker {} (mqtt.url)", self.broker);
                    self.log.clear();
                    self.opened = Some(Instant::now());
                    return session;
                }
                Err(error) => self.lost(&error),
            }
        }
    }

    /// Logs the end of a session, and schedules the next attempt.
    pub(super) fn lost(&mut self, error: &SessionError) {
        if let Some(opened) = self.opened.take() {
            self.backoff.reset_if_stable(opened.elapsed());
        }
        if self.log.should_log(&error.to_string()) {
            let broker = &self.broker;
            tracing::warn!("not publishing to the broker {broker} (mqtt.url): {error}");
        }
        self.next_attempt = Instant::now() + self.backoff.next_pause();
    }
}

#[cfg(test)]
mod tests {
    use tokio::{net::TcpListener, time::timeout};

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_dropped_attempt_does_not_shorten_the_pause() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let port = listener.local_addr().unwrap().port();
        drop(listener);
        let broker = format!("mqtt://127.0.0.1:{port}").parse().unwrap();
        let mut connector = Connector::new(broker, None, "lookdown").unwrap();
        let will = Message::retained("lookdown/status".to_owned(), "offline");
        for _ in 0..6 {
            connector.lost(&SessionError::Closed);
        }
        // The sixth pause is half of 32 s at least.
        let due = connector.next_attempt;
        assert!(due >= Instant::now() + Duration::from_secs(16));
        for _ in 0..3 {
            let dropped = timeout(Duration::from_secs(1), connector.session(&will)).await;
            assert!(dropped.is_err());
            assert_eq!(connector.next_attempt, due);
        }
    }
}

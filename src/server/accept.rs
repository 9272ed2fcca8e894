//! Accepting connections, whatever comes in between.

use std::{io, time::Duration};

use tokio::{
    net::{TcpListener, TcpStream},
    time::{Instant, sleep},
};

/// How long nothing is accepted after the system has refused.
const PAUSE: Duration = Duration::from_millis(100);
/// Refusals with less than this between them are one outage.
const OUTAGE: Duration = Duration::from_mins(1);

/// Accepts connections.
pub(super) struct Acceptor {
    listener: TcpListener,
    outage: Outage,
}

impl Acceptor {
    pub(super) fn new(listener: TcpListener) -> Self {
        Self {
            listener,
            outage: Outage::default(),
        }
    }

    /// The next connection. When the system gives none, such as for want of file descriptors, it is
    /// asked again after a pause.
    pub(super) async fn accept(&mut self) -> TcpStream {
        loop {
            match self.listener.accept().await {
                Ok((stream, _)) => return without_delay(stream),
                Err(error) if is_of_one_connection(&error) => {}
                Err(error) => {
                    if self.outage.begins(Instant::now()) {
                        tracing::error!(
                            "connections cannot be accepted ({error}): trying on; if these are too \
                             few file descriptors, raise their limit or lower \
                             server.max_connections"
                        );
                    }
                    sleep(PAUSE).await;
                }
            }
        }
    }

    /// Closes the listener and gives the connections that have come by then.
    pub(super) fn close(self) -> Vec<TcpStream> {
        // Asked directly: tokio may not have heard of the last ones yet.
        let Ok(listener) = self.listener.into_std() else {
            return Vec::new();
        };
        let waiting = std::iter::from_fn(|| listener.accept().ok());
        let streams = waiting.filter_map(|(stream, _)| {
            stream.set_nonblocking(true).ok()?;
            TcpStream::from_std(stream).ok()
        });
        streams.map(without_delay).collect()
    }
}

/// Without this, answers wait for the client's acknowledgement of earlier ones.
fn without_delay(stream: TcpStream) -> TcpStream {
    // A connection that has gone by now is found out when it is read.
    let _ = stream.set_nodelay(true);
    stream
}

/// Whether only the connection is lost that was about to be accepted.
fn is_of_one_connection(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::ConnectionAborted
            | io::ErrorKind::ConnectionReset
            | io::ErrorKind::ConnectionRefused
    )
}

/// Tells the first refusal of an outage from those that follow.
#[derive(Debug, Default)]
struct Outage {
    last: Option<Instant>,
}

impl Outage {
    /// Takes note of a refusal, and says whether an outage begins with it.
    fn begins(&mut self, now: Instant) -> bool {
        let last = self.last.replace(now);
        last.is_none_or(|last| now.duration_since(last) > OUTAGE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outage_is_told_once_however_often_it_is_run_into() {
        let mut outage = Outage::default();
        let start = Instant::now();
        let told = (0..1000).filter(|tenth| outage.begins(start + PAUSE * *tenth));
        assert_eq!(told.count(), 1);
        let later = start + PAUSE * 1000 + OUTAGE;
        assert!(outage.begins(later));
        assert!(!outage.begins(later + OUTAGE));
    }
}

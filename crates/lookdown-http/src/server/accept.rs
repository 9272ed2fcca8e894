//! Accepts connections, and retries after errors.

use std::{io, time::Duration};

use tokio::{
    net::{TcpListener, TcpStream},
    time::{Instant, sleep},
};

/// Pause after the system has refused a connection.
const PAUSE: Duration = Duration::from_millis(100);
/// Refusals that are less than this apart belong to one outage.
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

    /// Returns the next connection. When the system refuses one, for example for lack of file
    /// descriptors, it retries after a pause.
    pub(super) async fn accept(&mut self) -> TcpStream {
        loop {
            match self.listener.accept().await {
                Ok((stream, _)) => return without_delay(stream),
                Err(error) if is_of_one_connection(&error) => {}
                Err(error) => {
                    if self.outage.begins(Instant::now()) {
                        tracing::error!(
                            "connections cannot be accepted ({error}): retrying; if there are too \
                             few file descriptors, raise their limit or lower \
                             server.max_connections"
                        );
                    }
                    sleep(PAUSE).await;
                }
            }
        }
    }

    /// Closes the listener and returns the connections of its backlog.
    pub(super) fn close(self) -> Vec<TcpStream> {
        // Uses the socket directly: tokio may not have registered the last connections yet.
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

/// Disables Nagle's algorithm. Otherwise responses wait for the acknowledgement of earlier ones.
fn without_delay(stream: TcpStream) -> TcpStream {
    // A connection that is already closed is detected when it is read.
    let _ = stream.set_nodelay(true);
    stream
}

/// Returns true if the error concerns only the connection that was about to be accepted.
fn is_of_one_connection(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::ConnectionAborted
            | io::ErrorKind::ConnectionReset
            | io::ErrorKind::ConnectionRefused
    )
}

/// Distinguishes the first refusal of an outage from those that follow.
#[derive(Debug, Default)]
struct Outage {
    last: Option<Instant>,
}

impl Outage {
    /// Records a refusal. Returns true if an outage begins with it.
    fn begins(&mut self, now: Instant) -> bool {
        let last = self.last.replace(now);
        last.is_none_or(|last| now.duration_since(last) > OUTAGE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outage_is_reported_once() {
        let mut outage = Outage::default();
        let start = Instant::now();
        let reported = (0..1000).filter(|tenth| outage.begins(start + PAUSE * *tenth));
        assert_eq!(reported.count(), 1);
        let later = start + PAUSE * 1000 + OUTAGE;
        assert!(outage.begins(later));
        assert!(!outage.begins(later + OUTAGE));
    }
}

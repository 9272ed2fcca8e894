//! The connection limit: permits for regular connections, and short-lived permits for connections
//! beyond it.

use std::{collections::BTreeMap, num::NonZeroUsize, sync::Arc};

use parking_lot::Mutex;
use prometheus::IntGauge;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_util::sync::CancellationToken;

/// Most connections beyond the limit at the same time. They are answered with 503, except for
/// probes. When CPU time is short, those whose handshake waits for it are open as well.
const MAX_BEYOND_LIMIT: usize = 512;

/// Issues permits to connections.
///
/// A connection beyond the limit never waits for another one: when there are too many of them, the
/// oldest is closed. A probe is therefore accepted at once, regardless of the number of silent
/// connections.
pub(super) struct ConnectionPermits {
    regular: Arc<Semaphore>,
    beyond_limit: Arc<Mutex<BeyondLimit>>,
    /// The open connections.
    open: IntGauge,
}

/// The open connections beyond the limit.
#[derive(Default)]
struct BeyondLimit {
    /// The token that closes each of them, by the order of arrival.
    tokens: BTreeMap<u64, CancellationToken>,
    /// The number of all that have arrived.
    arrived: u64,
}

/// The permit of a connection. The connection counts as open until the permit is dropped.
pub(super) struct ConnectionPermit {
    place: Place,
    /// Cancelled to close the connection in favor of a newer one.
    pub(super) closed: CancellationToken,
    open: IntGauge,
}

/// The resource that a connection holds until its end.
enum Place {
    Regular(#[expect(dead_code, reason = "released when it is dropped")] OwnedSemaphorePermit),
    BeyondLimit {
        arrival: u64,
        all: Arc<Mutex<BeyondLimit>>,
    },
}

impl ConnectionPermits {
    pub(super) fn new(limit: NonZeroUsize, open: &IntGauge) -> Self {
        Self {
            regular: Arc::new(Semaphore::new(limit.get())),
            beyond_limit: Arc::default(),
            open: open.clone(),
        }
    }

    /// Returns a permit within the limit if one is free. Otherwise returns one beyond the limit,
    /// which may revoke the oldest of these.
    pub(super) fn take(&self) -> ConnectionPermit {
        let closed = CancellationToken::new();
        let place = match Arc::clone(&self.regular).try_acquire_owned() {
            Ok(permit) => Place::Regular(permit),
            Err(_) => Place::BeyondLimit {
                arrival: self.beyond_limit.lock().add(closed.clone()),
                all: Arc::clone(&self.beyond_limit),
            },
        };
        self.open.inc();
        ConnectionPermit {
            place,
            closed,
            open: self.open.clone(),
        }
    }
}

impl BeyondLimit {
    /// Adds a connection, and closes the oldest one if there are too many. Returns the order of its
    /// arrival.
    fn add(&mut self, closed: CancellationToken) -> u64 {
        let arrival = self.arrived;
        self.arrived += 1;
        self.tokens.insert(arrival, closed);
        if self.tokens.len() > MAX_BEYOND_LIMIT
            && let Some((_, oldest)) = self.tokens.pop_first()
        {
            oldest.cancel();
        }
        arrival
    }
}

impl ConnectionPermit {
    /// Returns true if the connection is within the limit.
    pub(super) fn is_regular(&self) -> bool {
        matches!(self.place, Place::Regular(_))
    }
}

impl Drop for ConnectionPermit {
    fn drop(&mut self) {
        if let Place::BeyondLimit { arrival, all } = &self.place {
            all.lock().tokens.remove(arrival);
        }
        self.open.dec();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oldest_connection_beyond_the_limit_makes_room() {
        let open = IntGauge::new("connections", "Open connections.").unwrap();
        let permits = ConnectionPermits::new(NonZeroUsize::MIN, &open);
        let regular = permits.take();
        let beyond: Vec<_> = (0..=MAX_BEYOND_LIMIT).map(|_| permits.take()).collect();
        assert!(regular.is_regular() && !regular.closed.is_cancelled());
        assert!(beyond.iter().all(|permit| !permit.is_regular()));
        let closed = beyond.iter().filter(|permit| permit.closed.is_cancelled());
        assert_eq!(closed.count(), 1);
        assert!(beyond[0].closed.is_cancelled());
        drop(regular);
        assert!(permits.take().is_regular());
    }

    #[test]
    fn ended_connections_do_not_close_open_ones() {
        let open = IntGauge::new("connections", "Open connections.").unwrap();
        let permits = ConnectionPermits::new(NonZeroUsize::MIN, &open);
        let _regular = permits.take();
        let probe = permits.take();
        for _ in 0..=MAX_BEYOND_LIMIT {
            drop(permits.take());
        }
        assert!(!probe.closed.is_cancelled());
        assert_eq!(open.get(), 2);
    }
}

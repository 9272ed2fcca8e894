//! The connection limit: permits for regular connections, and short-lived permits for connections
//! beyond it.

use std::{collections::VecDeque, num::NonZeroUsize, sync::Arc};

use parking_lot::Mutex;
use prometheus::IntGauge;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_util::sync::CancellationToken;

/// Most connections beyond the limit at the same time. They are answered with 503, except for
/// probes.
const MAX_BEYOND_LIMIT: usize = 256;

/// Issues permits to connections.
///
/// A connection beyond the limit never waits for another one: when there are too many of them, the
/// oldest is closed. A probe is therefore accepted at once, regardless of the number of silent
/// connections.
pub(super) struct ConnectionPermits {
    regular: Arc<Semaphore>,
    /// Tokens that close the latest connections beyond the limit, oldest first.
    beyond_limit: Mutex<VecDeque<CancellationToken>>,
    /// The open connections.
    open: IntGauge,
}

/// The permit of a connection. The connection counts as open until the permit is dropped.
pub(super) struct ConnectionPermit {
    /// `None` beyond the limit.
    regular: Option<OwnedSemaphorePermit>,
    /// Cancelled to close the connection in favour of a newer one.
    pub(super) closed: CancellationToken,
    open: IntGauge,
}

impl ConnectionPermits {
    pub(super) fn new(limit: NonZeroUsize, open: &IntGauge) -> Self {
        Self {
            regular: Arc::new(Semaphore::new(limit.get())),
            beyond_limit: Mutex::default(),
            open: open.clone(),
        }
    }

    /// Returns a permit within the limit if one is free. Otherwise returns one beyond the limit,
    /// which may revoke the oldest of these.
    pub(super) fn take(&self) -> ConnectionPermit {
        let regular = Arc::clone(&self.regular).try_acquire_owned().ok();
        let closed = CancellationToken::new();
        if regular.is_none() {
            let mut beyond = self.beyond_limit.lock();
            beyond.push_back(closed.clone());
            if beyond.len() > MAX_BEYOND_LIMIT
                && let Some(oldest) = beyond.pop_front()
            {
                oldest.cancel();
            }
        }
        self.open.inc();
        ConnectionPermit {
            regular,
            closed,
            open: self.open.clone(),
        }
    }
}

impl ConnectionPermit {
    /// Returns true if the connection is within the limit.
    pub(super) fn is_regular(&self) -> bool {
        self.regular.is_some()
    }
}

impl Drop for ConnectionPermit {
    fn drop(&mut self) {
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
}

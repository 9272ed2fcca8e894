//! How many connections there may be, and how many there are.

use std::{num::NonZeroUsize, sync::Arc};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::metrics::Metrics;

/// So many connections beyond the limit are accepted to be told so. Further ones wait in the
/// operating system's queue.
const PLACES_BEYOND_LIMIT: usize = 64;

/// The places of connections.
pub(super) struct Places {
    regular: Arc<Semaphore>,
    beyond_limit: Arc<Semaphore>,
    metrics: Arc<Metrics>,
}

/// The place of a connection, which counts as open until this is dropped.
pub(super) struct Place {
    /// Whether it is within the limit.
    pub(super) is_regular: bool,
    _permit: OwnedSemaphorePermit,
    metrics: Arc<Metrics>,
}

impl Places {
    pub(super) fn new(limit: NonZeroUsize, metrics: &Arc<Metrics>) -> Self {
        Self {
            regular: Arc::new(Semaphore::new(limit.get())),
            beyond_limit: Arc::new(Semaphore::new(PLACES_BEYOND_LIMIT)),
            metrics: Arc::clone(metrics),
        }
    }

    /// A place within the limit, else one beyond it, else the next that becomes free.
    pub(super) async fn take(&self) -> Place {
        if let Some(place) = self.try_take() {
            return place;
        }
        let (is_regular, permit) = tokio::select! {
            permit = Arc::clone(&self.regular).acquire_owned() => (true, permit),
            permit = Arc::clone(&self.beyond_limit).acquire_owned() => (false, permit),
        };
        match permit {
            Ok(permit) => self.place(is_regular, permit),
            // Nobody closes the semaphores.
            Err(_) => std::future::pending().await,
        }
    }

    /// A place that is free now.
    pub(super) fn try_take(&self) -> Option<Place> {
        let regular = Arc::clone(&self.regular).try_acquire_owned();
        if let Ok(permit) = regular {
            return Some(self.place(true, permit));
        }
        let beyond_limit = Arc::clone(&self.beyond_limit).try_acquire_owned();
        Some(self.place(false, beyond_limit.ok()?))
    }

    fn place(&self, is_regular: bool, permit: OwnedSemaphorePermit) -> Place {
        self.metrics.connections.inc();
        Place {
            is_regular,
            _permit: permit,
            metrics: Arc::clone(&self.metrics),
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.metrics.connections.dec();
    }
}

//! The listeners to published reports. Each listener has its own bounded queue. A listener whose
//! queue overflows gets no more reports, so the publisher never waits and memory stays bounded.

use std::{collections::HashMap, num::NonZeroUsize, sync::Arc};

use lookdown_detect::fairness::{BudgetError, BudgetShare, Client, SharedBudget};
use parking_lot::Mutex;
use tokio::sync::{mpsc, watch};

use super::{Cameras, StoredReport};
use crate::metrics::Metrics;

/// Most reports that wait for a listener.
const QUEUE: usize = 64;

/// The reason why a new listener is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ListenError {
    /// The maximum number of listeners is reached.
    #[error("all {most} permitted listeners are connected (results.max_listeners)")]
    Full {
        /// The maximum number of listeners.
        most: usize,
    },
    /// The client has too many listeners.
    #[error(
        "{client} uses its share of the listeners already ({share} of {most}, \
         results.max_listeners): close event streams, or retry"
    )]
    ShareUsed {
        /// The client.
        client: Client,
        /// The maximum number of listeners of one client.
        share: usize,
        /// The maximum number of listeners.
        most: usize,
    },
    /// The store does not answer.
    #[error(transparent)]
    Unreachable(#[from] Unreachable),
    /// The server is shutting down.
    #[error("no more reports will be published: the server is shutting down")]
    Ended,
}

/// The result store does not answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the result store does not answer: {0}")]
pub struct Unreachable(pub String);

/// All listeners.
#[derive(Debug)]
pub struct Listeners {
    /// The permits, including those of dropped listeners that have not noticed yet.
    budget: SharedBudget,
    // No change can panic before it is complete.
    group: Mutex<Group>,
    /// The number of times that cameras got their first listener.
    arrivals: watch::Sender<u64>,
    /// The number of times that cameras were removed.
    removals: watch::Sender<u64>,
    metrics: Arc<Metrics>,
}

#[derive(Debug, Default)]
struct Group {
    ended: bool,
    last_number: u64,
    queues: HashMap<Cameras, HashMap<u64, mpsc::Sender<Arc<StoredReport>>>>,
}

impl Listeners {
    /// Creates a group of at most `most` listeners, of which half may be of one client.
    pub fn new(most: NonZeroUsize, metrics: Arc<Metrics>) -> Self {
        Self {
            budget: SharedBudget::new(most.get()),
            group: Mutex::default(),
            arrivals: watch::Sender::default(),
            removals: watch::Sender::default(),
            metrics,
        }
    }

    /// Adds a listener that receives everything that is published here from now on. A store that
    /// servers share may publish here only a moment later, see [`super::ResultStore::listen`].
    ///
    /// # Errors
    /// [`ListenError`] when all permits, or those of the client, are in use, or the server is
    /// shutting down.
    pub fn listen(
        self: &Arc<Self>,
        client: &Client,
        to: Cameras,
    ) -> Result<Listening, ListenError> {
        let mut group = self.group.lock();
        if group.ended {
            return Err(ListenError::Ended);
        }
        let most = self.budget.total();
        let permit = self.budget.take(client, 1).map_err(|error| match error {
            BudgetError::Full => ListenError::Full { most },
            BudgetError::ShareUsed { share } => ListenError::ShareUsed {
                client: client.clone(),
                share,
                most,
            },
        })?;
        group.last_number += 1;
        let number = group.last_number;
        let (sender, queue) = mpsc::channel(QUEUE);
        let queues = group.queues.entry(to.clone()).or_default();
        queues.insert(number, sender);
        if queues.len() == 1 {
            self.arrivals.send_modify(|count| *count += 1);
        }
        self.metrics.results_listeners.inc();
        Ok(Listening {
            queue,
            to,
            number,
            listeners: Arc::clone(self),
            _permit: permit,
        })
    }

    /// Returns a receiver that changes when a camera is removed from the store by this process.
    pub fn removals(&self) -> watch::Receiver<u64> {
        self.removals.subscribe()
    }

    /// Reports that a camera was removed.
    pub(super) fn note_removal(&self) {
        self.removals.send_modify(|count| *count += 1);
    }

    /// Returns a receiver that changes when cameras get their first listener.
    pub(super) fn arrivals(&self) -> watch::Receiver<u64> {
        self.arrivals.subscribe()
    }

    /// The cameras that have listeners.
    pub(super) fn cameras(&self) -> Vec<Cameras> {
        self.group.lock().queues.keys().cloned().collect()
    }

    /// Returns true if these cameras have a listener.
    pub(super) fn has_listener_for(&self, cameras: &Cameras) -> bool {
        self.group.lock().queues.contains_key(cameras)
    }

    /// Publishes a report to the listeners of its camera and to those of all cameras. Never waits.
    pub fn notify(&self, report: &Arc<StoredReport>) {
        for to in [Cameras::All, Cameras::One(report.report.camera.clone())] {
            self.publish_to(&to, report);
        }
    }

    /// Publishes a report to the listeners to these cameras. Never waits.
    pub(super) fn publish_to(&self, to: &Cameras, report: &Arc<StoredReport>) {
        let mut group = self.group.lock();
        if let Some(queues) = group.queues.get_mut(to) {
            let before = queues.len();
            queues.retain(|_, queue| queue.try_send(Arc::clone(report)).is_ok());
            let dropped = (before - queues.len()) as u64;
            self.metrics.results_listeners_dropped.inc_by(dropped);
            if queues.is_empty() {
                group.queues.remove(to);
            }
        }
    }

    /// Ends the stream of every listener.
    pub fn end(&self) {
        let mut group = self.group.lock();
        group.ended = true;
        group.queues.clear();
    }

    fn leave(&self, to: &Cameras, number: u64) {
        self.metrics.results_listeners.dec();
        let mut group = self.group.lock();
        if let Some(queues) = group.queues.get_mut(to) {
            queues.remove(&number);
            if queues.is_empty() {
                group.queues.remove(to);
            }
        }
    }
}

/// A listener's permit and queue. Dropping it releases the permit.
#[derive(Debug)]
pub struct Listening {
    queue: mpsc::Receiver<Arc<StoredReport>>,
    to: Cameras,
    number: u64,
    listeners: Arc<Listeners>,
    _permit: BudgetShare,
}

impl Listening {
    /// Returns the next report, or `None` when there will be no more: this listener did not keep
    /// up, or the server is shutting down.
    pub async fn next(&mut self) -> Option<Arc<StoredReport>> {
        self.queue.recv().await
    }
}

impl Drop for Listening {
    fn drop(&mut self) {
        self.listeners.leave(&self.to, self.number);
    }
}

#[cfg(test)]
mod tests;

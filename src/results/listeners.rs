//! Who listens to what is published. Each listener has a queue of its own; whoever lets it run full is
//! told nothing more, so that nobody has to wait for him and no memory fills up.

use std::{
    collections::HashMap,
    num::NonZeroUsize,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use tokio::sync::mpsc;

use super::{Cameras, StoredReport};

/// Reports that may wait for a listener.
const QUEUE: usize = 64;

/// Nobody can listen now.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ListenError {
    /// Every place is taken.
    #[error("{most} listeners are there already, and no more may be (results.max_listeners)")]
    Full {
        /// How many places there are.
        most: usize,
    },
    /// The server ends.
    #[error("nothing more will be told: the server is shutting down")]
    Ended,
}

/// Everybody who listens.
#[derive(Debug)]
pub struct Listeners {
    most: NonZeroUsize,
    group: Mutex<Group>,
}

#[derive(Debug, Default)]
struct Group {
    ended: bool,
    /// Places taken, also by those who are told nothing more and have not noticed yet.
    places: usize,
    dropped: u64,
    last_number: u64,
    queues: HashMap<Cameras, HashMap<u64, mpsc::Sender<Arc<StoredReport>>>>,
}

impl Listeners {
    /// Room for so many.
    #[must_use]
    pub fn new(most: NonZeroUsize) -> Self {
        Self {
            most,
            group: Mutex::default(),
        }
    }

    /// A place from which everything is heard that is published from now on.
    ///
    /// # Errors
    /// [`ListenError`] when there is no place, or nothing will be published any more.
    pub fn listen(self: &Arc<Self>, to: Cameras) -> Result<Listening, ListenError> {
        let mut group = self.group();
        if group.ended {
            return Err(ListenError::Ended);
        }
        let most = self.most.get();
        if group.places >= most {
            return Err(ListenError::Full { most });
        }
        group.places += 1;
        group.last_number += 1;
        let number = group.last_number;
        let (sender, queue) = mpsc::channel(QUEUE);
        let queues = group.queues.entry(to.clone()).or_default();
        queues.insert(number, sender);
        Ok(Listening {
            queue,
            to,
            number,
            listeners: Arc::clone(self),
        })
    }

    /// Whether anybody would be told of a report of this camera.
    pub(super) fn are_there_for(&self, camera: &str) -> bool {
        let group = self.group();
        let one = Cameras::One(camera.to_owned());
        group.queues.contains_key(&Cameras::All) || group.queues.contains_key(&one)
    }

    /// Tells a report to whoever listens to its camera. Never waits.
    pub fn tell(&self, report: &Arc<StoredReport>) {
        let mut group = self.group();
        let group = &mut *group;
        for to in [Cameras::All, Cameras::One(report.report.camera.clone())] {
            if let Some(queues) = group.queues.get_mut(&to) {
                let before = queues.len();
                queues.retain(|_, queue| queue.try_send(Arc::clone(report)).is_ok());
                group.dropped += (before - queues.len()) as u64;
                if queues.is_empty() {
                    group.queues.remove(&to);
                }
            }
        }
    }

    /// Tells everybody that nothing more will come.
    pub fn end(&self) {
        let mut group = self.group();
        group.ended = true;
        group.queues.clear();
    }

    /// How many places are taken.
    #[must_use]
    pub fn count(&self) -> usize {
        self.group().places
    }

    /// How many were given up because they did not keep up.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.group().dropped
    }

    fn group(&self) -> MutexGuard<'_, Group> {
        // No change can panic half-way.
        self.group.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn leave(&self, to: &Cameras, number: u64) {
        let mut group = self.group();
        group.places -= 1;
        if let Some(queues) = group.queues.get_mut(to) {
            queues.remove(&number);
            if queues.is_empty() {
                group.queues.remove(to);
            }
        }
    }
}

/// A listener's place; free again when this is dropped.
#[derive(Debug)]
pub struct Listening {
    queue: mpsc::Receiver<Arc<StoredReport>>,
    to: Cameras,
    number: u64,
    listeners: Arc<Listeners>,
}

impl Listening {
    /// The next report; `None` when nothing more will be told, because this listener did not keep up
    /// or the server ends.
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

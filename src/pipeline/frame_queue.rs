//! The queue of frames that wait for a worker.

use std::{
    collections::BTreeMap,
    sync::{Condvar, Mutex, MutexGuard, PoisonError},
};

use super::{
    Priority,
    ticket::{Turn, Turns},
};

/// A queue ordered by priority, then by arrival. The caller of `push` bounds its length.
pub(super) struct FrameQueue<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
}

struct State<T> {
    waiting: BTreeMap<Turn, T>,
    turns: Turns,
    closed: bool,
}

impl<T> FrameQueue<T> {
    pub(super) fn new() -> Self {
        Self {
            state: Mutex::new(State {
                waiting: BTreeMap::new(),
                turns: Turns::default(),
                closed: false,
            }),
            changed: Condvar::new(),
        }
    }

    /// Queues an entry. Returns it as an error if the queue is closed.
    pub(super) fn push(&self, priority: Priority, entry: T) -> Result<(), T> {
        let mut state = self.lock();
        if state.closed {
            return Err(entry);
        }
        let turn = state.turns.next(priority);
        state.waiting.insert(turn, entry);
        drop(state);
        self.changed.notify_one();
        Ok(())
    }

    /// Waits for the next entry; `None` if the queue is closed and empty. Blocks.
    pub(super) fn pop(&self) -> Option<T> {
        let mut state = self
            .changed
            .wait_while(self.lock(), |state| {
                state.waiting.is_empty() && !state.closed
            })
            .unwrap_or_else(PoisonError::into_inner);
        state.waiting.pop_first().map(|(_, entry)| entry)
    }

    /// Closes the queue for new entries. Waiting entries can still be popped.
    pub(super) fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        // No change can panic part-way, so a poisoned state is still consistent.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_leave_by_priority_then_by_arrival() {
        let queue = FrameQueue::new();
        for (level, name) in [(5, "a"), (9, "b"), (6, "c"), (1, "d"), (7, "e")] {
            let priority = Priority::of_level(level);
            queue.push(priority, name).unwrap();
        }
        queue.close();
        let served: Vec<_> = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(served, ["d", "a", "c", "b", "e"]);
    }

    #[test]
    fn a_closed_queue_returns_new_entries() {
        let queue = FrameQueue::new();
        queue.close();
        assert_eq!(queue.push(Priority::default(), 7), Err(7));
        assert_eq!(queue.pop(), None);
    }
}

//! The queue of frames that wait for a worker.

use std::collections::BTreeMap;

use parking_lot::{Condvar, Mutex};

use super::{
    Ticket,
    turns::{Turn, Turns},
};

/// A queue ordered by priority, then by the turns of the clients. The caller of `push` bounds its
/// length.
pub(super) struct FrameQueue<T> {
    // No change can panic part-way, so the state is consistent after a panic.
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

    /// Queues an entry, which costs its client `cost`. Returns it as an error if the queue is
    /// closed.
    pub(super) fn push(&self, ticket: &Ticket, cost: usize, entry: T) -> Result<(), T> {
        let mut state = self.state.lock();
        if state.closed {
            return Err(entry);
        }
        let turn = state.turns.next(ticket.priority, &ticket.client, cost);
        state.waiting.insert(turn, entry);
        drop(state);
        self.changed.notify_one();
        Ok(())
    }

    /// Waits for the next entry; `None` if the queue is closed and empty. Blocks.
    pub(super) fn pop(&self) -> Option<T> {
        let mut state = self.state.lock();
        self.changed.wait_while(&mut state, |state| {
            state.waiting.is_empty() && !state.closed
        });
        let (turn, entry) = state.waiting.pop_first()?;
        state.turns.end(&turn);
        Some(entry)
    }

    /// Closes the queue for new entries. Waiting entries can still be popped.
    pub(super) fn close(&self) {
        self.state.lock().closed = true;
        self.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{fairness::Client, parameters::Priority};

    fn ticket(level: u32, name: &str) -> Ticket {
        Ticket {
            priority: Priority::from_level(level),
            client: Client::with_key(name),
            ..Ticket::default()
        }
    }

    fn drained<T>(queue: &FrameQueue<T>) -> Vec<T> {
        queue.close();
        std::iter::from_fn(|| queue.pop()).collect()
    }

    #[test]
    fn frames_leave_by_priority_then_by_arrival() {
        let queue = FrameQueue::new();
        for (level, name) in [(5, "a"), (9, "b"), (6, "c"), (1, "d"), (7, "e")] {
            queue.push(&ticket(level, "one"), 1, name).unwrap();
        }
        assert_eq!(drained(&queue), ["d", "a", "c", "b", "e"]);
    }

    #[test]
    fn clients_of_one_priority_take_turns() {
        let queue = FrameQueue::new();
        for entry in ["g1", "g2", "g3", "g4"] {
            queue.push(&ticket(5, "greedy"), 1, entry).unwrap();
        }
        queue.push(&ticket(5, "one"), 1, "o1").unwrap();
        queue.push(&ticket(5, "two"), 1, "t1").unwrap();
        queue.push(&ticket(5, "one"), 1, "o2").unwrap();
        let order = ["g1", "o1", "t1", "g2", "o2", "g3", "g4"];
        assert_eq!(drained(&queue), order);
    }

    #[test]
    fn a_closed_queue_returns_new_entries() {
        let queue = FrameQueue::new();
        queue.close();
        assert_eq!(queue.push(&Ticket::default(), 1, 7), Err(7));
        assert_eq!(queue.pop(), None);
    }
}

//! The queue of views for inference. A batch holds views of the first frame and is filled up with
//! views of the next frames for the same model.

use std::{collections::BTreeMap, sync::Arc, time::Instant};

use parking_lot::{Condvar, Mutex};

use super::{BatchOptions, Claim, PassTask};
use crate::{
    inference::Model,
    pipeline::{
        PipelineError,
        turns::{Turn, Turns},
    },
};

/// The queue of views for inference, bounded by the number of frames in progress.
pub(super) struct ViewQueue {
    options: BatchOptions,
    // No update can panic half-way.
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    waiting: BTreeMap<Turn, Waiting>,
    turns: Turns,
    closed: bool,
}

struct Waiting {
    task: Arc<PassTask>,
    next_view: usize,
}

impl Waiting {
    fn views_left(&self) -> usize {
        self.task.rig.view_count() - self.next_view
    }

    fn is_for(&self, model: &Arc<Model>) -> bool {
        Arc::ptr_eq(model, &self.task.model)
    }
}

impl ViewQueue {
    pub(super) fn new(options: BatchOptions) -> Self {
        Self {
            options,
            state: Mutex::default(),
            changed: Condvar::new(),
        }
    }

    /// Queues all views of a task.
    pub(super) fn submit(&self, task: Arc<PassTask>) {
        if task.rig.view_count() == 0 {
            return;
        }
        let mut state = self.state.lock();
        let ticket = &task.ticket;
        let cost = task.rig.view_count();
        let turn = state.turns.next(ticket.priority, &ticket.client, cost);
        let waiting = Waiting { task, next_view: 0 };
        state.waiting.insert(turn, waiting);
        drop(state);
        self.changed.notify_all();
    }

    /// Closes the queue for new tasks. Views already queued are still dispatched.
    pub(super) fn close(&self) {
        self.state.lock().closed = true;
        self.changed.notify_all();
    }

    /// Waits for the views of the next run, in queue order and all for one model. Returns `None`
    /// when the queue is closed and empty.
    pub(super) fn next_batch(&self) -> Option<Vec<Claim>> {
        let mut state = self.state.lock();
        loop {
            state.drop_pointless();
            let Some(first) = state.waiting.values().next() else {
                if state.closed {
                    return None;
                }
                self.changed.wait(&mut state);
                continue;
            };
            let model = Arc::clone(&first.task.model);
            let most = model.batch_of(self.options.max_views).get();
            let due = first.task.queued + self.options.max_delay;
            let to_wait = due.saturating_duration_since(Instant::now());
            if to_wait.is_zero() || state.closed || state.views_for(&model) >= most {
                return Some(state.claim(&model, most));
            }
            self.changed.wait_for(&mut state, to_wait);
        }
    }
}

impl State {
    /// Drops the views of failed tasks and of tasks whose client has disconnected.
    fn drop_pointless(&mut self) {
        let pointless = |_: &Turn, waiting: &mut Waiting| waiting.task.is_pointless();
        for (turn, waiting) in self.waiting.extract_if(.., pointless) {
            waiting.task.fail(PipelineError::Withdrawn);
            self.turns.end(&turn);
        }
    }

    /// Returns the number of views queued for a model.
    fn views_for(&self, model: &Arc<Model>) -> usize {
        let alike = self
            .waiting
            .values()
            .filter(|waiting| waiting.is_for(model));
        alike.map(Waiting::views_left).sum()
    }

    /// Claims the next views for a model, at most `most`.
    fn claim(&mut self, model: &Arc<Model>, most: usize) -> Vec<Claim> {
        let mut room = most;
        let mut claims = Vec::new();
        let alike = self.waiting.values_mut();
        for waiting in alike.filter(|waiting| waiting.is_for(model)) {
            if room == 0 {
                break;
            }
            let end = waiting.next_view + room.min(waiting.views_left());
            claims.push(Claim {
                task: Arc::clone(&waiting.task),
                views: waiting.next_view..end,
            });
            room -= end - waiting.next_view;
            waiting.next_view = end;
        }
        let is_claimed = |_: &Turn, waiting: &mut Waiting| waiting.views_left() == 0;
        for (turn, _) in self.waiting.extract_if(.., is_claimed) {
            self.turns.end(&turn);
        }
        claims
    }
}

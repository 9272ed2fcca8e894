//! Who keeps a connection waiting, and until when it may.

use std::{future::pending, time::Duration};

use tokio::{
    sync::watch,
    time::{Instant, sleep_until},
};

use super::ConnectionLimits;

/// What a connection waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// For the head of its first request.
    FirstHead,
    /// For the rest of a later request's head.
    Head,
    /// For the next request.
    Idle,
    /// For the service, which has deadlines of its own.
    Service,
}

#[derive(Debug, Clone, Copy)]
struct State {
    phase: Phase,
    /// When the phase has taken too long.
    until: Option<Instant>,
    /// When the client, which does not take what it is sent, has done so for too long.
    blocked_until: Option<Instant>,
}

/// Follows a connection, and notices when its client takes too long.
#[derive(Debug)]
pub(super) struct Pace {
    state: watch::Sender<State>,
    header_timeout: Duration,
    idle_timeout: Duration,
}

impl Pace {
    /// A connection that has just been accepted.
    pub(super) fn new(limits: &ConnectionLimits) -> Self {
        let state = State {
            phase: Phase::FirstHead,
            until: Some(Instant::now() + limits.header_timeout),
            blocked_until: None,
        };
        Self {
            state: watch::Sender::new(state),
            header_timeout: limits.header_timeout,
            idle_timeout: limits.idle_timeout,
        }
    }

    /// Bytes have come.
    pub(super) fn received(&self) {
        self.state.send_if_modified(|state| {
            let head_begins = state.phase == Phase::Idle;
            if head_begins {
                state.phase = Phase::Head;
                state.until = Some(Instant::now() + self.header_timeout);
            }
            head_begins
        });
    }

    /// The head of a request is complete.
    pub(super) fn request_begins(&self) {
        self.state.send_modify(|state| {
            state.phase = Phase::Service;
            state.until = None;
        });
    }

    /// The last byte of an answer is on its way.
    pub(super) fn request_ends(&self) {
        self.state.send_modify(|state| {
            state.phase = Phase::Idle;
            state.until = Some(Instant::now() + self.idle_timeout);
        });
    }

    /// The client takes, or does not take, what it is sent.
    pub(super) fn sending(&self, is_blocked: bool) {
        self.state.send_if_modified(|state| {
            let changes = is_blocked != state.blocked_until.is_some();
            if changes {
                state.blocked_until = is_blocked.then(|| Instant::now() + self.idle_timeout);
            }
            changes
        });
    }

    /// Whether there was no request yet.
    pub(super) fn awaits_first_request(&self) -> bool {
        self.state.borrow().phase == Phase::FirstHead
    }

    /// Waits until the client has taken too long.
    pub(super) async fn overdue(&self) {
        let mut changes = self.state.subscribe();
        loop {
            let State {
                until,
                blocked_until,
                ..
            } = *changes.borrow_and_update();
            let deadline = [until, blocked_until].into_iter().flatten().min();
            let passed = async {
                match deadline {
                    Some(deadline) => sleep_until(deadline).await,
                    None => pending().await,
                }
            };
            tokio::select! {
                // The sender is `self`, so the channel cannot close meanwhile.
                _ = changes.changed() => {}
                () = passed => return,
            }
        }
    }
}

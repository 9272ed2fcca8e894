//! The state of the link to Redis: one shared connection, or the reason why there is none.

use lookdown_common::text::one_line;
use redis::{RedisError, RetryMethod, aio::MultiplexedConnection};
use tokio::sync::watch;

use crate::{metrics::IntGauge, results::Unreachable};

/// The shared connection to Redis, if there is one now.
#[derive(Debug)]
pub(super) struct Link {
    state: watch::Sender<State>,
    /// 1 while there is a connection.
    up: IntGauge,
}

enum State {
    Up(Line),
    Down(String),
}

/// A connection and its sequence number.
#[derive(Clone)]
pub(super) struct Line {
    pub(super) connection: MultiplexedConnection,
    number: u64,
}

impl std::fmt::Debug for State {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.problem().map_or("up", |_| "down"))
    }
}

impl Link {
    pub(super) fn new(up: IntGauge) -> Self {
        let state = State::Down("not connected yet".to_owned());
        Self {
            state: watch::Sender::new(state),
            up,
        }
    }

    /// Sets the current connection.
    pub(super) fn is_up(&self, connection: MultiplexedConnection, number: u64) {
        let state = State::Up(Line { connection, number });
        self.change(|now| {
            *now = state;
            true
        });
    }

    /// Removes the connection and keeps the reason.
    pub(super) fn is_down(&self, problem: &RedisError) {
        self.change(|now| {
            *now = State::Down(one_line(problem));
            true
        });
    }

    /// Returns the outcome of a query. A connection that has failed is removed.
    pub(super) fn outcome<T>(
        &self,
        line: &Line,
        outcome: Result<T, RedisError>,
    ) -> Result<T, Unreachable> {
        outcome.map_err(|error| {
            if !is_refusal(&error) {
                self.change(|state| {
                    // It may have been replaced in the meantime.
                    let is_it = matches!(state, State::Up(now) if now.number == line.number);
                    if is_it {
                        *state = State::Down(one_line(&error));
                    }
                    is_it
                });
            }
            Unreachable(one_line(&error))
        })
    }

    /// Changes the state, unless `change` returns false.
    fn change(&self, change: impl FnOnce(&mut State) -> bool) {
        self.state.send_if_modified(|state| {
            let is_changed = change(state);
            self.up.set(i64::from(state.problem().is_none()));
            is_changed
        });
    }

    /// The connection, or an error with the reason why there is none.
    pub(super) fn line(&self) -> Result<Line, Unreachable> {
        match &*self.state.borrow() {
            State::Up(line) => Ok(line.clone()),
            State::Down(problem) => Err(Unreachable(problem.clone())),
        }
    }

    /// Waits until there is a connection.
    pub(super) async fn next_line(&self) -> Line {
        loop {
            let mut state = self.state.subscribe();
            // The sender is `self`, so the channel cannot close during the wait.
            if let Ok(state) = state.wait_for(|state| state.problem().is_none()).await
                && let State::Up(line) = &*state
            {
                return line.clone();
            }
        }
    }

    /// Waits until there is no connection, and returns the reason.
    pub(super) async fn lost(&self) -> String {
        let mut state = self.state.subscribe();
        let down = state.wait_for(|state| state.problem().is_some()).await;
        down.ok()
            .and_then(|state| state.problem().map(ToOwned::to_owned))
            .unwrap_or_default()
    }

    /// The reason why there is no connection.
    pub(super) fn problem(&self) -> Option<String> {
        self.state.borrow().problem().map(ToOwned::to_owned)
    }
}

impl State {
    fn problem(&self) -> Option<&str> {
        match self {
            Self::Up(_) => None,
            Self::Down(problem) => Some(problem),
        }
    }
}

/// Returns true if Redis has answered, and a retry would get the same answer.
pub(super) fn is_refusal(error: &RedisError) -> bool {
    let is_about_us = !error.is_io_error() && !error.is_timeout();
    is_about_us && matches!(error.retry_method(), RetryMethod::NoRetry)
}

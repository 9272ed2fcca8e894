//! The options and the state that the store shares with its background tasks.
//!
//! The channels whose reports are published here from now on.
//!
//! The keys and channels in Redis. All of an installation share one hash tag, so that a managed
//! endpoint in front of several nodes has them on one, where a script can change all of them.
//!
//! The state of the link to Redis: one shared connection, or the reason why there is none.

use std::{collections::HashSet, sync::Arc};

use lookdown_common::text::one_line;
use redis::{RedisError, RetryMethod, aio::MultiplexedConnection};
use tokio::sync::watch;

use super::{RedisAddress, address::Connector, outbox::Outbox};
use crate::{
    metrics::{IntCounter, IntGauge},
    results::{Cameras, Listeners, ResultLimits, Unreachable},
};

/// The Redis server and the part of it that this installation uses.
#[derive(Debug, Clone, PartialEq)]
pub struct RedisOptions {
    /// Its address.
    pub address: RedisAddress,
    /// The prefix of all keys: servers with the same prefix share their reports.
    pub key_prefix: String,
}

/// The state that the store shares with its background tasks.
pub(super) struct Shared {
    pub(super) options: RedisOptions,
    pub(super) connector: Connector,
    pub(super) limits: ResultLimits,
    pub(super) keys: Keys,
    pub(super) link: Link,
    pub(super) followed: Followed,
    pub(super) outbox: Outbox,
    pub(super) listeners: Arc<Listeners>,
    pub(super) stored: IntCounter,
}

/// The followed channels, by their cameras.
#[derive(Debug, Default)]
pub(super) struct Followed(watch::Sender<HashSet<Cameras>>);

impl Followed {
    /// Waits until the reports of these cameras are published here.
    pub(super) async fn contains(&self, cameras: &Cameras) {
        let mut followed = self.0.subscribe();
        // The sender is `self`, so the channel cannot close during the wait.
        let _ = followed.wait_for(|all| all.contains(cameras)).await;
    }

    pub(super) fn insert(&self, cameras: Cameras) {
        self.0.send_modify(|all| {
            all.insert(cameras);
        });
    }

    /// Removes the channels that are not needed, and returns them.
    pub(super) fn remove_unless(&self, is_needed: impl Fn(&Cameras) -> bool) -> Vec<Cameras> {
        let mut removed = Vec::new();
        self.0.send_if_modified(|all| {
            removed.extend(all.extract_if(|cameras| !is_needed(cameras)));
            false
        });
        removed
    }

    pub(super) fn clear(&self) {
        self.0.send_modify(HashSet::clear);
    }
}

/// The keys and channels of one installation. They all begin with the same prefix.
#[derive(Debug)]
pub(super) struct Keys {
    /// The hash tag: the prefix in braces.
    tag: String,
    /// The database. Keys belong to a database, channels to all of them.
    database: i64,
}

impl Keys {
    pub(super) fn new(prefix: &str, database: i64) -> Self {
        Self {
            tag: format!("{{{prefix}}}"),
            database,
        }
    }

    /// The keys of forget.lua, in its order. `earlier` is a sorted set of the reports that are not
    /// their camera's latest: `ID:SIZE:CAMERA`. `cameras` is a sorted set of the cameras by the ID
    /// of their latest report. `totals` is a hash of the newest ID (`last`) and the total size of
    /// all reports (`bytes`). `images` is a sorted set of the cameras that have an image, by the ID
    /// of its report.
    pub(super) fn index(&self) -> [String; 5] {
        ["earlier", "cameras", "latest", "totals", "images"].map(|name| self.key(name))
    }

    /// A hash of a camera's image: the report's ID (`id`), `frame` and `sketch`.
    pub(super) fn image(&self, camera: &str) -> String {
        self.prefix_of_images() + camera
    }

    /// The prefix of the keys of all images.
    pub(super) fn prefix_of_images(&self) -> String {
        self.key("image:")
    }

    /// A stream of a camera's reports.
    pub(super) fn camera(&self, camera: &str) -> String {
        self.prefix_of_cameras() + camera
    }

    /// The prefix of the keys of all cameras.
    pub(super) fn prefix_of_cameras(&self) -> String {
        self.key("camera:")
    }

    /// The channel on which new reports of these cameras are published.
    pub(super) fn channel(&self, cameras: &Cameras) -> String {
        let Self { tag, database } = self;
        match cameras {
            Cameras::All => format!("{tag}:{database}:all"),
            Cameras::One(camera) => format!("{tag}:{database}:camera:{camera}"),
        }
    }

    /// The key of this name. `senders` is a sorted set of the servers by the number of the last
    /// report that each sent; see [`Self::index`] for the others.
    pub(super) fn key(&self, name: &str) -> String {
        format!("{}:{name}", self.tag)
    }
}

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

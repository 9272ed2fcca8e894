//! The options and the state that the store shares with its background tasks.
//!
//! The channels whose reports are published here from now on.
//!
//! The keys and channels in Redis. All of an installation share one hash tag, so that a managed
//! endpoint in front of several nodes has them on one, where a script can change all of them.
//!
//! The state of the link to Redis: one shared connection, or the reason why there is none.
//!
//! A bounded queue of reports for Redis. Publishing never waits. When the queue is full, the oldest
//! reports are dropped.

use std::{
    collections::{HashSet, VecDeque},
    sync::Arc,
};

use lookdown_common::text::one_line;
use parking_lot::Mutex;
use redis::{RedisError, RetryMethod, aio::MultiplexedConnection};
use tokio::sync::{Notify, watch};

use super::{RedisAddress, address::Connector};
use crate::{
    annotated_image::StoredFrame,
    metrics::{IntCounter, IntGauge},
    results::{Cameras, Listeners, NewReport, ResultLimits, Unreachable},
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

/// Most reports that wait: minutes of a few cameras.
const MOST_REPORTS: usize = 1000;
const MOST_BYTES: usize = 32 << 20;

/// A report, possibly with its image.
#[derive(Debug)]
pub(super) struct PendingReport {
    pub(super) report: NewReport,
    pub(super) image: Option<StoredFrame>,
}

/// The queue, oldest first.
#[derive(Debug)]
pub(super) struct Outbox {
    // No change can panic before it is complete.
    waiting: Mutex<Waiting>,
    changed: Notify,
    /// Reports that were dropped or refused.
    dropped: IntCounter,
}

#[derive(Debug, Default)]
struct Waiting {
    reports: VecDeque<PendingReport>,
    bytes: usize,
    /// True while a report was taken and is not done.
    one_is_taken: bool,
}

impl Outbox {
    /// Creates an empty queue that counts dropped and refused reports in `dropped`.
    pub(super) fn new(dropped: IntCounter) -> Self {
        Self {
            waiting: Mutex::default(),
            changed: Notify::new(),
            dropped,
        }
    }

    /// Appends a report. Never waits.
    pub(super) fn push(&self, report: NewReport, image: Option<StoredFrame>) {
        let pending = PendingReport { report, image };
        let mut waiting = self.waiting.lock();
        waiting.drop_image_of(&pending.report.camera);
        waiting.bytes += pending.bytes();
        waiting.reports.push_back(pending);
        while waiting.reports.len() > MOST_REPORTS || waiting.bytes > MOST_BYTES {
            waiting.take_first();
            self.dropped.inc();
        }
        drop(waiting);
        self.changed.notify_waiters();
    }

    /// Waits for the first report and takes it. [`Outbox::done`] completes it.
    pub(super) async fn first(&self) -> PendingReport {
        loop {
            let changed = self.changed.notified();
            tokio::pin!(changed);
            // Registers for the notification before the check, so that no report is missed in
            // between.
            changed.as_mut().enable();
            if let Some(first) = self.take() {
                return first;
            }
            changed.await;
        }
    }

    /// Completes the report that was taken: it was stored, or it was `refused` permanently.
    pub(super) fn done(&self, refused: bool) {
        let mut waiting = self.waiting.lock();
        waiting.one_is_taken = false;
        drop(waiting);
        self.dropped.inc_by(u64::from(refused));
        self.changed.notify_waiters();
    }

    /// Waits until the queue is empty.
    pub(super) async fn is_empty(&self) {
        loop {
            let changed = self.changed.notified();
            tokio::pin!(changed);
            changed.as_mut().enable();
            if self.count() == 0 {
                return;
            }
            changed.await;
        }
    }

    /// The number of reports that are not done.
    pub(super) fn count(&self) -> usize {
        let waiting = self.waiting.lock();
        waiting.reports.len() + usize::from(waiting.one_is_taken)
    }

    fn take(&self) -> Option<PendingReport> {
        let mut waiting = self.waiting.lock();
        let first = waiting.take_first()?;
        waiting.one_is_taken = true;
        Some(first)
    }
}

impl PendingReport {
    fn bytes(&self) -> usize {
        self.report.bytes() + self.image.as_ref().map_or(0, StoredFrame::bytes)
    }
}

impl Waiting {
    /// Drops the camera's queued image, as a later report replaces it.
    fn drop_image_of(&mut self, camera: &str) {
        let mut own = self.reports.iter_mut().rev();
        let last = own.find(|pending| pending.report.camera == camera);
        if let Some(image) = last.and_then(|pending| pending.image.take()) {
            self.bytes -= image.bytes();
        }
    }

    fn take_first(&mut self) -> Option<PendingReport> {
        let first = self.reports.pop_front()?;
        self.bytes -= first.bytes();
        Some(first)
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use jiff::Timestamp;

    use super::*;

    fn outbox() -> Outbox {
        Outbox::new(IntCounter::new("dropped", "Dropped reports.").unwrap())
    }

    fn report(persons: usize, length: usize) -> NewReport {
        NewReport {
            camera: "lobby".to_owned(),
            received_at: Timestamp::UNIX_EPOCH,
            persons,
            scores: None,
            json: Bytes::from(vec![b' '; length]),
        }
    }

    #[tokio::test]
    async fn reports_are_taken_in_arrival_order() {
        let outbox = outbox();
        let (taken, ()) = tokio::join!(
            async {
                [outbox.first().await, outbox.first().await].map(|pending| pending.report.persons)
            },
            async {
                outbox.push(report(1, 1), None);
                outbox.push(report(2, 1), None);
            }
        );
        assert_eq!(taken, [1, 2]);
    }

    #[tokio::test]
    async fn a_full_outbox_drops_and_counts_the_oldest_reports() {
        for length in [1, MOST_BYTES / 10] {
            let outbox = outbox();
            for number in 0..2 * MOST_REPORTS {
                outbox.push(report(number, length), None);
            }
            let kept = outbox.count();
            assert!((1..=MOST_REPORTS).contains(&kept), "{kept}");
            assert!(kept * length <= MOST_BYTES);
            assert_eq!(outbox.dropped.get(), (2 * MOST_REPORTS - kept) as u64);
            assert_eq!(outbox.first().await.report.persons, 2 * MOST_REPORTS - kept);
        }
    }

    #[tokio::test]
    async fn the_outbox_is_empty_when_the_last_report_is_done() {
        let outbox = outbox();
        outbox.is_empty().await;
        outbox.push(report(1, 1), None);
        tokio::join!(outbox.is_empty(), async {
            outbox.first().await;
            assert_eq!(outbox.count(), 1);
            outbox.done(true);
        });
        assert_eq!((outbox.count(), outbox.dropped.get()), (0, 1));
    }

    #[tokio::test]
    async fn only_the_latest_image_of_a_camera_waits() {
        let outbox = outbox();
        let image = |length| StoredFrame {
            jpeg: Bytes::from(vec![0; length]),
            sketch: Bytes::new(),
        };
        for number in 1..=9 {
            outbox.push(report(number, 1), Some(image(MOST_BYTES / 2)));
        }
        assert_eq!((outbox.count(), outbox.dropped.get()), (9, 0));
        for number in 1..=9 {
            let pending = outbox.first().await;
            assert_eq!(pending.report.persons, number);
            assert_eq!(pending.image.is_some(), number == 9);
        }
    }
}

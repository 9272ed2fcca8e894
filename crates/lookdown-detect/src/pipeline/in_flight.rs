//! The work in flight: its permits, and the detection of a pool that makes no progress.
//!
//! Progress is the beginning or the end of work, a change of the stage of begun work, or a finished
//! batch of its views. The arrival of more work is none. All times are arguments, so that tests
//! decide them.

use std::{
    collections::BTreeMap,
    fmt,
    sync::Arc,
    time::{Duration, Instant},
};

use parking_lot::Mutex;

use super::{Stage, Ticket};
use crate::fairness::BudgetShare;

/// The most work that a report of a stall lists.
const MAX_LISTED: usize = 16;

/// All work that waits or is being processed.
#[derive(Debug, Default)]
pub(super) struct InFlight(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    last_number: u64,
    work: BTreeMap<u64, Work>,
    /// The last beginning or end of work, or the arrival of the first work.
    progressed: Option<Instant>,
    /// `true` if the current stall has been reported.
    is_reported: bool,
}

#[derive(Debug)]
struct Work {
    ticket: Ticket,
    arrived: Instant,
    has_begun: bool,
}

/// The permits of some work. Dropping it ends the work.
#[derive(Debug)]
pub(super) struct InFlightGuard {
    in_flight: Arc<InFlight>,
    number: u64,
    /// The end of the work, unless the guard is just dropped.
    ended: Option<Instant>,
    _permits: BudgetShare,
}

/// A pool that makes no progress.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stall {
    /// The time since the last progress.
    pub since: Duration,
    /// The work in flight, the longest first; at most 16.
    pub work: Vec<StalledWork>,
}

/// Work that makes no progress.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StalledWork {
    /// The ID of its request; empty if it has none.
    pub request_id: String,
    /// `waiting` for a worker, `network` for an inference thread, a stage, or `other` work.
    pub stage: &'static str,
    /// The time since its arrival.
    pub age: Duration,
}

impl InFlight {
    /// Adds work that waits from now on.
    pub(super) fn add(
        self: &Arc<Self>,
        ticket: &Ticket,
        permits: BudgetShare,
        now: Instant,
    ) -> InFlightGuard {
        let mut state = self.0.lock();
        if state.work.is_empty() {
            state.progress(now);
        }
        state.last_number += 1;
        let number = state.last_number;
        let work = Work {
            ticket: ticket.clone(),
            arrived: now,
            has_begun: false,
        };
        state.work.insert(number, work);
        InFlightGuard {
            in_flight: Arc::clone(self),
            number,
            ended: None,
            _permits: permits,
        }
    }

    /// Returns the amount of work that waits or is being processed.
    pub(super) fn count(&self) -> usize {
        self.0.lock().work.len()
    }

    /// Returns the time without progress. Zero without work.
    pub(super) fn quiet_for(&self, now: Instant) -> Duration {
        self.0.lock().quiet_for(now)
    }

    /// Returns the stall that has lasted for at least `limit`, if there is one.
    pub(super) fn stall(&self, now: Instant, limit: Duration) -> Option<Stall> {
        self.0.lock().stall(now, limit)
    }

    /// Returns a stall like [`InFlight::stall`], but each only once.
    pub(super) fn new_stall(&self, now: Instant, limit: Duration) -> Option<Stall> {
        let mut state = self.0.lock();
        let stall = state.stall(now, limit);
        let is_new = stall.is_some() && !state.is_reported;
        state.is_reported = stall.is_some();
        stall.filter(|_| is_new)
    }
}

impl State {
    fn progress(&mut self, at: Instant) {
        self.progressed = self.progressed.max(Some(at));
    }

    fn quiet_for(&self, now: Instant) -> Duration {
        if self.work.is_empty() {
            return Duration::ZERO;
        }
        let begun = self.work.values().filter(|work| work.has_begun);
        let stages = begun.map(|work| work.ticket.timeline.standing().1);
        let last = stages.max().flatten().max(self.progressed);
        last.map_or(Duration::ZERO, |last| now.saturating_duration_since(last))
    }

    fn stall(&self, now: Instant, limit: Duration) -> Option<Stall> {
        let since = self.quiet_for(now);
        if since < limit {
            return None;
        }
        let work = self.work.values().take(MAX_LISTED);
        Some(Stall {
            since,
            work: work.map(|work| work.stalled(now)).collect(),
        })
    }
}

impl Work {
    fn stalled(&self, now: Instant) -> StalledWork {
        let stage = match self.ticket.timeline.standing().0 {
            _ if !self.has_begun => "waiting",
            Some(Stage::Queue) => "network",
            Some(stage) => stage.name(),
            None => "other",
        };
        StalledWork {
            request_id: self.ticket.request_id.clone(),
            stage,
            age: now.saturating_duration_since(self.arrived),
        }
    }
}

impl InFlightGuard {
    /// Records that a worker has taken the work.
    pub(super) fn begin(&self, now: Instant) {
        let mut state = self.in_flight.0.lock();
        state.progress(now);
        if let Some(work) = state.work.get_mut(&self.number) {
            work.has_begun = true;
        }
    }

    /// Ends the work and releases its permits.
    pub(super) fn end(mut self, now: Instant) {
        self.ended = Some(now);
    }
}

impl Drop for InFlightGuard {
    fn drop(&mut self) {
        let mut state = self.in_flight.0.lock();
        state.work.remove(&self.number);
        state.progress(self.ended.unwrap_or_else(Instant::now));
    }
}

impl fmt::Display for StalledWork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = self.age.as_secs();
        write!(f, "{} ({}, {seconds} s)", self.request_id, self.stage)
    }
}

impl fmt::Display for Stall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let work: Vec<_> = self.work.iter().map(ToString::to_string).collect();
        f.write_str(&work.join(", "))
    }
}

#[cfg(test)]
mod tests;

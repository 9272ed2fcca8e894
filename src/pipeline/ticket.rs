//! What a frame brings to every queue: its turn, whether anybody still waits for it, and when it was
//! where.

use tokio_util::sync::CancellationToken;

use super::Timeline;

/// Who goes first: 1 before 9. Frames of one priority are served in the order of their arrival.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Priority(u64);

impl Priority {
    /// Who goes first of all.
    pub const FIRST: u64 = 1;
    /// Who goes last of all.
    pub const LAST: u64 = 9;

    /// The priority of this level, if it is one.
    #[must_use]
    pub fn new(level: u64) -> Option<Self> {
        let levels = Self::FIRST..=Self::LAST;
        levels.contains(&level).then_some(Self(level))
    }
}

impl Default for Priority {
    /// In the middle.
    fn default() -> Self {
        Self(5)
    }
}

/// Travels with a frame through every queue.
#[derive(Debug, Clone, Default)]
pub struct Ticket {
    /// Its priority.
    pub priority: Priority,
    /// Cancelled as soon as nobody waits for the report: what has not begun never will.
    pub withdrawn: CancellationToken,
    /// When it was in which stage.
    pub timeline: Timeline,
}

impl Ticket {
    /// A ticket for somebody who waits.
    #[must_use]
    pub fn of(priority: Priority) -> Self {
        Self {
            priority,
            ..Self::default()
        }
    }
}

/// A place in a queue: by priority, then by arrival.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Turn {
    priority: Priority,
    arrival: u64,
}

/// Hands out turns.
#[derive(Debug, Default)]
pub(super) struct Turns {
    arrivals: u64,
}

impl Turns {
    pub(super) fn next(&mut self, priority: Priority) -> Turn {
        self.arrivals += 1;
        Turn {
            priority,
            arrival: self.arrivals,
        }
    }
}

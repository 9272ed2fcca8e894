//! What a frame brings to every queue: its turn, whether anybody still waits for it, and when it was
//! where.

use tokio_util::sync::CancellationToken;

use super::Timeline;

/// The priority of a frame in every queue. Frames of one priority are served in the order of their arrival.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Priority {
    /// Served first.
    High,
    /// Served after high priority.
    #[default]
    Normal,
    /// Served last.
    Low,
}

impl Priority {
    /// Returns the priority of a level as requests give it: 1 to 3 are high, 4 to 6 normal, 7 to 9 low.
    #[must_use]
    pub fn of_level(level: u32) -> Self {
        match level {
            ..=3 => Self::High,
            4..=6 => Self::Normal,
            7.. => Self::Low,
        }
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

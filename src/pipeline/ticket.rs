//! The ticket of a frame in every queue: its priority, its cancellation token and its timeline.

use tokio_util::sync::CancellationToken;

use super::Timeline;

/// The priority of a frame in every queue. Frames of one priority are served in order of arrival.
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
    /// Returns the priority of a level in a request: 1 to 3 are high, 4 to 6 normal, 7 to 9 low.
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
    /// The priority of the frame.
    pub priority: Priority,
    /// The token that is cancelled when the client disconnects. Work that has not begun is skipped.
    pub withdrawn: CancellationToken,
    /// The times at which the frame entered and left each stage.
    pub timeline: Timeline,
}

impl Ticket {
    /// Creates a ticket that is not withdrawn.
    #[must_use]
    pub fn of(priority: Priority) -> Self {
        Self {
            priority,
            ..Self::default()
        }
    }
}

/// A position in a queue, ordered by priority, then by arrival.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Turn {
    priority: Priority,
    arrival: u64,
}

/// Assigns positions in a queue.
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

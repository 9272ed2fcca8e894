//! The ticket of a frame in every queue: its priority, its client, its cancellation token and its
//! timeline.

use tokio_util::sync::CancellationToken;

use super::Timeline;
use crate::fairness::Client;

/// The priority of a frame in every queue. Within a priority, clients take turns.
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

    /// Returns the smallest level of the priority.
    #[must_use]
    pub fn highest_level(self) -> u32 {
        match self {
            Self::High => 1,
            Self::Normal => 4,
            Self::Low => 7,
        }
    }
}

/// Travels with a frame through every queue.
#[derive(Debug, Clone, Default)]
pub struct Ticket {
    /// The priority of the frame.
    pub priority: Priority,
    /// The client whose turns and budgets the frame uses.
    pub client: Client,
    /// The ID of the request for logs; empty if it has none.
    pub request_id: String,
    /// The width of the annotated image that the response draws, pixels; 0 for none.
    pub drawn_width: u32,
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

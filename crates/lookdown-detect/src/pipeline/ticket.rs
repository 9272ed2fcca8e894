//! The ticket of a frame in every queue: its priority, its client, its cancellation token and its
//! timeline.

use tokio_util::sync::CancellationToken;

use super::Timeline;
use crate::{fairness::Client, parameters::Priority};

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

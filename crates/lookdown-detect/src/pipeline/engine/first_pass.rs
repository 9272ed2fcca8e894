//! The first work of the network on a frame.

use std::sync::Arc;

use crate::pipeline::network::PassTask;

/// The first work of the network on a frame.
pub(super) enum FirstPass {
    /// The views of the whole frame.
    Search,
    /// Crops of followed persons, which are queued.
    Crops(Arc<PassTask>),
    /// Nothing: no followed person has moved.
    Nothing,
}

//! Batching options for views.

use std::{num::NonZeroUsize, time::Duration};

/// Batching options for views.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BatchOptions {
    /// The maximum number of views in one run of the network.
    pub max_views: NonZeroUsize,
    /// The maximum time that the first view of a batch waits for more views.
    pub max_delay: Duration,
}

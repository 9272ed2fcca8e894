//! The content of a transaction of the store.

use crate::{
    scene::SceneState,
    sums::{Owner, Sums, Totals},
};

/// The content of the next transaction of the store.
pub(crate) struct Batch {
    pub(crate) last_event: u64,
    /// The totals with these sums.
    pub(crate) totals: Totals,
    pub(crate) sums: Sums,
    /// Changed scenes; `None` for those that are gone.
    pub(crate) scenes: Vec<(Owner, Option<SceneState>)>,
}

impl Batch {
    /// Returns a batch without news.
    pub(crate) fn empty(last_event: u64, totals: Totals) -> Self {
        Self {
            last_event,
            totals,
            sums: Sums::default(),
            scenes: Vec::new(),
        }
    }
}

//! The content of a transaction of the store.

use crate::{
    scene::SceneState,
    sums::{Owner, Sums, Totals},
};

/// The content of the next transaction of the store.
#[derive(Default)]
pub(crate) struct Batch {
    pub(crate) last_event: u64,
    /// The totals with these sums.
    pub(crate) totals: Totals,
    pub(crate) sums: Sums,
    /// Changed scenes; `None` for those that are gone.
    pub(crate) scenes: Vec<(Owner, Option<SceneState>)>,
}

//! The views that a thread has claimed.

use std::sync::Arc;

use super::PassTask;

/// Views of one pass that a thread has claimed.
pub(super) struct Claim {
    pub(super) task: Arc<PassTask>,
    pub(super) views: std::ops::Range<usize>,
}

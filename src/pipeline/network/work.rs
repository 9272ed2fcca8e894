//! What the network did for a frame, and when.

use std::time::{Duration, Instant};

/// What the network did for a frame, and when.
#[derive(Debug, Clone, Copy)]
pub(in crate::pipeline) struct Work {
    /// When the first of them was begun.
    pub(in crate::pipeline) began: Instant,
    /// When the last of them was done.
    pub(in crate::pipeline) ended: Instant,
    /// Time spent on rendering, by all threads.
    pub(in crate::pipeline) remap: Duration,
    /// Time spent in the network, by all threads.
    pub(in crate::pipeline) inference: Duration,
    /// Runs of the network. A run that several frames share belongs to the one that was next.
    pub(in crate::pipeline) runs: usize,
    /// Views that were not looked at, as nothing had moved in them.
    pub(in crate::pipeline) still_views: usize,
    /// Candidates dropped because a number of theirs was not finite.
    pub(in crate::pipeline) non_finite: usize,
}

impl Work {
    /// No work at all, as for a rig without views.
    pub(super) fn none(queued: Instant) -> Self {
        Self {
            began: queued,
            ended: queued,
            remap: Duration::ZERO,
            inference: Duration::ZERO,
            runs: 0,
            still_views: 0,
            non_finite: 0,
        }
    }

    /// Both together.
    pub(in crate::pipeline) fn and(self, other: Self) -> Self {
        Self {
            began: self.began.min(other.began),
            ended: self.ended.max(other.ended),
            remap: self.remap + other.remap,
            inference: self.inference + other.inference,
            runs: self.runs + other.runs,
            still_views: self.still_views + other.still_views,
            non_finite: self.non_finite + other.non_finite,
        }
    }

    /// Which share of the work was rendering, 0 to 1.
    pub(in crate::pipeline) fn remap_share(&self) -> f64 {
        let (remap, all) = (self.remap, self.remap + self.inference);
        if all.is_zero() {
            return 0.0;
        }
        remap.as_secs_f64() / all.as_secs_f64()
    }
}

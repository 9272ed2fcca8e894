//! Counters and times of the inference for one frame.

use std::time::{Duration, Instant};

/// Counters and times of the inference for one frame.
#[derive(Debug, Clone, Copy)]
pub(in crate::pipeline) struct BatchCost {
    /// The start of the first view.
    pub(in crate::pipeline) began: Instant,
    /// The end of the last view.
    pub(in crate::pipeline) ended: Instant,
    /// Rendering time, summed over all threads.
    pub(in crate::pipeline) remap: Duration,
    /// Inference time, summed over all threads.
    pub(in crate::pipeline) inference: Duration,
    /// Runs of the network. A run shared by several frames counts for the first of them only.
    pub(in crate::pipeline) runs: usize,
    /// Views that skipped the network because nothing had moved in them.
    pub(in crate::pipeline) still_views: usize,
    /// Candidates dropped because one of their numbers was not finite.
    pub(in crate::pipeline) non_finite: usize,
}

impl BatchCost {
    /// Returns no cost, as for a rig without views.
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

    /// Returns the sum of both.
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

    /// Returns the share of the time spent on rendering, 0 to 1.
    pub(in crate::pipeline) fn remap_share(&self) -> f64 {
        let (remap, all) = (self.remap, self.remap + self.inference);
        if all.is_zero() {
            return 0.0;
        }
        remap.as_secs_f64() / all.as_secs_f64()
    }
}

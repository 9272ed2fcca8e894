//! The cache of rigs: built once, shared, bounded in bytes, with least-recently-used eviction.

use std::sync::Arc;

use moka::{notification::RemovalCause, policy::EvictionPolicy, sync::Cache};

use super::camera_rig::CameraRig;
use crate::{
    metrics::{DetectMetrics, gauge_value},
    parameters::Profile,
};

/// The cache key of a rig.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct RigKey {
    pub(super) camera: RigCamera,
    pub(super) frame_size: (u32, u32),
    pub(super) profile: Profile,
    pub(super) input_size: (u32, u32),
}

/// The lens for which a rig was built.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum RigCamera {
    /// A calibration at a revision.
    Calibrated { id: String, revision: String },
    /// An assumed lens on a circle, rounded to whole steps.
    Assumed { cx: i64, cy: i64, radius: i64 },
}

/// A bounded cache of rigs.
pub(super) struct RigCache {
    rigs: Cache<RigKey, Arc<CameraRig>>,
    metrics: Arc<DetectMetrics>,
}

impl RigCache {
    pub(super) fn new(budget_bytes: usize, metrics: Arc<DetectMetrics>) -> Self {
        let counted = Arc::clone(&metrics);
        let evicted = move |_: Arc<RigKey>, rig: Arc<CameraRig>, _: RemovalCause| {
            counted.rig_cache_evictions.inc();
            counted.rig_cache_rigs.dec();
            counted.rig_cache_bytes.sub(gauge_value(rig.bytes()));
        };
        // A rig larger than the budget is kept alone: it would be built for each frame otherwise.
        let weight = move |_: &RigKey, rig: &Arc<CameraRig>| {
            u32::try_from(rig.bytes().min(budget_bytes)).unwrap_or(u32::MAX)
        };
        let rigs = Cache::builder()
            .max_capacity(budget_bytes as u64)
            .weigher(weight)
            .eviction_policy(EvictionPolicy::lru())
            .eviction_listener(evicted)
            .build();
        Self { rigs, metrics }
    }

    /// Returns the rig for `key`, built by `build` unless it is cached. Other callers with the same
    /// key wait for that build.
    pub(super) fn get_or_build(
        &self,
        key: &RigKey,
        build: impl FnOnce() -> CameraRig,
    ) -> Arc<CameraRig> {
        let entry = self.rigs.entry_by_ref(key);
        let entry = entry.or_insert_with(|| Arc::new(build()));
        if entry.is_fresh() {
            let bytes = gauge_value(entry.value().bytes());
            self.metrics.rig_cache_builds.inc();
            self.metrics.rig_cache_rigs.inc();
            self.metrics.rig_cache_bytes.add(bytes);
            // Evicts now: the cache would do it some time later.
            self.rigs.run_pending_tasks();
        }
        entry.into_value()
    }
}

#[cfg(test)]
mod tests;

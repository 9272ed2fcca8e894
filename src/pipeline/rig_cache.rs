//! The cache of rigs: built once, shared, bounded in bytes, with least-recently-used eviction.

use std::{
    collections::HashMap,
    sync::{Arc, OnceLock},
};

use parking_lot::Mutex;

use super::{Profile, camera_rig::CameraRig};
use crate::metrics::{Metrics, gauge_value};

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
    budget_bytes: usize,
    entries: Mutex<Entries>,
    metrics: Arc<Metrics>,
}

#[derive(Debug, Default)]
struct Entries {
    by_key: HashMap<RigKey, Entry>,
    clock: u64,
    /// The size of all built rigs.
    bytes: usize,
}

#[derive(Debug, Default)]
struct Entry {
    /// Filled by the first caller. Other callers with the same key wait for that build.
    rig: Arc<OnceLock<Arc<CameraRig>>>,
    last_used: u64,
    /// The size of the rig, once it is built and counted.
    bytes: Option<usize>,
}

impl RigCache {
    pub(super) fn new(budget_bytes: usize, metrics: Arc<Metrics>) -> Self {
        Self {
            budget_bytes,
            entries: Mutex::default(),
            metrics,
        }
    }

    /// Returns the rig for `key`, built by `build` unless it is cached.
    pub(super) fn get_or_build(
        &self,
        key: &RigKey,
        build: impl FnOnce() -> CameraRig,
    ) -> Arc<CameraRig> {
        let slot = {
            let mut entries = self.lock();
            entries.clock += 1;
            let now = entries.clock;
            let entry = entries.by_key.entry(key.clone()).or_default();
            entry.last_used = now;
            Arc::clone(&entry.rig)
        };
        let mut is_new = false;
        let rig = Arc::clone(slot.get_or_init(|| {
            is_new = true;
            Arc::new(build())
        }));
        if is_new {
            let mut entries = self.lock();
            entries.count(key, rig.bytes());
            let evicted = entries.evict_beyond(self.budget_bytes, key);
            self.metrics.rig_cache_builds.inc();
            self.metrics.rig_cache_evictions.inc_by(evicted);
            let rigs = entries
                .by_key
                .values()
                .filter(|entry| entry.bytes.is_some());
            self.metrics.rig_cache_rigs.set(gauge_value(rigs.count()));
            self.metrics.rig_cache_bytes.set(gauge_value(entries.bytes));
        }
        rig
    }

    fn lock(&self) -> parking_lot::MutexGuard<'_, Entries> {
        // Every update of the entries is a single step, so a panic cannot leave them inconsistent.
        self.entries.lock()
    }
}

impl Entries {
    /// Counts the rig that was just built for `key`. Only counted rigs are evicted, so its entry
    /// exists.
    fn count(&mut self, key: &RigKey, bytes: usize) {
        if let Some(entry) = self.by_key.get_mut(key) {
            entry.bytes = Some(bytes);
            self.bytes += bytes;
        }
    }

    /// Evicts the least recently used rigs until the rest fits. `newest` is never evicted.
    /// Returns the number of evicted rigs.
    fn evict_beyond(&mut self, budget_bytes: usize, newest: &RigKey) -> u64 {
        let mut evicted = 0;
        while self.bytes > budget_bytes {
            let oldest = self
                .by_key
                .iter()
                .filter(|(key, entry)| *key != newest && entry.bytes.is_some())
                .min_by_key(|(_, entry)| entry.last_used)
                .map(|(key, _)| key.clone());
            let Some(oldest) = oldest else { break };
            if let Some(entry) = self.by_key.remove(&oldest) {
                self.bytes -= entry.bytes.unwrap_or(0);
                evicted += 1;
            }
        }
        evicted
    }
}

#[cfg(test)]
mod tests;

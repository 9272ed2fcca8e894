//! Rigs in memory: built once, shared, bounded by bytes, least recently used out first.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, OnceLock, PoisonError},
};

use super::{Profile, camera_rig::CameraRig};

/// What a rig was built for.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct RigKey {
    pub(super) camera: RigCamera,
    pub(super) frame_size: (u32, u32),
    pub(super) profile: Profile,
    pub(super) input_size: (u32, u32),
}

/// Which lens a rig was built for.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum RigCamera {
    /// A calibration at a revision.
    Calibrated { id: String, revision: String },
    /// An assumed lens on a circle, rounded to whole steps.
    Assumed { cx: i64, cy: i64, radius: i64 },
}

/// A bounded cache of rigs.
#[derive(Debug)]
pub(super) struct RigCache {
    budget_bytes: usize,
    entries: Mutex<Entries>,
}

#[derive(Debug, Default)]
struct Entries {
    by_key: HashMap<RigKey, Entry>,
    clock: u64,
}

#[derive(Debug, Default)]
struct Entry {
    /// Filled by whoever asks first; others with the same key wait for that one build.
    rig: Arc<OnceLock<Arc<CameraRig>>>,
    last_used: u64,
}

impl Entry {
    fn bytes(&self) -> usize {
        self.rig.get().map_or(0, |rig| rig.bytes())
    }
}

impl RigCache {
    pub(super) fn new(budget_bytes: usize) -> Self {
        Self {
            budget_bytes,
            entries: Mutex::default(),
        }
    }

    /// The rig for `key`, built by `build` unless it is there.
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
        let rig = Arc::clone(slot.get_or_init(|| Arc::new(build())));
        self.evict_beyond_budget(key);
        rig
    }

    /// Drops the least recently used rigs until the rest fits; `newest` stays in any case.
    fn evict_beyond_budget(&self, newest: &RigKey) {
        let mut entries = self.lock();
        let mut total: usize = entries.by_key.values().map(Entry::bytes).sum();
        while total > self.budget_bytes {
            let oldest = entries
                .by_key
                .iter()
                .filter(|(key, entry)| *key != newest && entry.bytes() > 0)
                .min_by_key(|(_, entry)| entry.last_used)
                .map(|(key, _)| key.clone());
            let Some(oldest) = oldest else { break };
            if let Some(entry) = entries.by_key.remove(&oldest) {
                total -= entry.bytes();
            }
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Entries> {
        // Every change to the entries is a single step, so a panic cannot leave them half changed.
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests;

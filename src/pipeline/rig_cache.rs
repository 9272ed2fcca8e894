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
    /// Of the rigs that are built.
    bytes: usize,
    builds: u64,
    evictions: u64,
}

#[derive(Debug, Default)]
struct Entry {
    /// Filled by whoever asks first; others with the same key wait for that one build.
    rig: Arc<OnceLock<Arc<CameraRig>>>,
    last_used: u64,
    /// Of the rig, once it is built and counted.
    bytes: Option<usize>,
}

/// How full a cache of camera rigs is, and what it has done so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RigCacheUse {
    /// Rigs in memory.
    pub rigs: usize,
    /// Memory that their tables hold, bytes.
    pub bytes: usize,
    /// Rigs built since the start.
    pub builds: u64,
    /// Rigs dropped to make room since the start.
    pub evictions: u64,
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
        let mut is_new = false;
        let rig = Arc::clone(slot.get_or_init(|| {
            is_new = true;
            Arc::new(build())
        }));
        if is_new {
            let mut entries = self.lock();
            entries.count(key, rig.bytes());
            entries.evict_beyond(self.budget_bytes, key);
        }
        rig
    }

    /// How full the cache is, and what it has done so far.
    pub(super) fn usage(&self) -> RigCacheUse {
        let entries = self.lock();
        let built = entries
            .by_key
            .values()
            .filter(|entry| entry.bytes.is_some());
        RigCacheUse {
            rigs: built.count(),
            bytes: entries.bytes,
            builds: entries.builds,
            evictions: entries.evictions,
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Entries> {
        // Every change to the entries is a single step, so a panic cannot leave them half changed.
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Entries {
    /// Counts the rig that was just built for `key`. Only counted ones are evicted, so its entry
    /// is there.
    fn count(&mut self, key: &RigKey, bytes: usize) {
        self.builds += 1;
        if let Some(entry) = self.by_key.get_mut(key) {
            entry.bytes = Some(bytes);
            self.bytes += bytes;
        }
    }

    /// Drops the least recently used rigs until the rest fits; `newest` stays in any case.
    fn evict_beyond(&mut self, budget_bytes: usize, newest: &RigKey) {
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
                self.evictions += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests;

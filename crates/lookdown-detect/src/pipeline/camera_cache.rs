//! A cache with one entry for each camera.

use std::sync::Arc;

use moka::{policy::EvictionPolicy, sync::Cache};

/// Maximum number of cached cameras. The least recently used camera is evicted first.
const MAX_CAMERAS: u64 = 256;

/// The entries of the latest cameras.
pub(super) struct CameraCache<V>(Cache<String, Arc<V>>);

impl<V: Send + Sync + 'static> Default for CameraCache<V> {
    fn default() -> Self {
        let cameras = Cache::builder().max_capacity(MAX_CAMERAS);
        Self(cameras.eviction_policy(EvictionPolicy::lru()).build())
    }
}

impl<V: Send + Sync + 'static> CameraCache<V> {
    /// Returns the entry of a camera, if there is one.
    pub(super) fn get(&self, camera: &str) -> Option<Arc<V>> {
        self.0.get(camera)
    }

    /// Removes the entry of a camera.
    pub(super) fn remove(&self, camera: &str) {
        self.0.invalidate(camera);
    }

    /// Returns the entry of a camera; a new one if there is none or if the known one `is_stale`.
    pub(super) fn get_or_renew(
        &self,
        camera: &str,
        new: impl FnOnce() -> V,
        mut is_stale: impl FnMut(&V) -> bool,
    ) -> Arc<V> {
        let entry = self.0.entry_by_ref(camera);
        entry
            .or_insert_with_if(|| Arc::new(new()), |known| is_stale(known))
            .into_value()
    }
}

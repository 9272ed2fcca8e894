//! The inference cache: detections of recent frames, so that a request for the same frame with
//! other refinement parameters needs no inference. Only frames whose request opts in are cached.

use std::{
    collections::VecDeque,
    sync::{Arc, Weak},
};

use parking_lot::{Mutex, MutexGuard};

use super::{camera_rig::CameraRig, pass::Pass};
use crate::{
    inference::{Model, ViewDetection},
    metrics::IntCounter,
};

/// Maximum memory of all cached frames: detections and the remap tables of later passes.
const MAX_BYTES: usize = 32 << 20;

/// The key of a frame: its content, its views and its model.
#[derive(Clone)]
pub(super) struct FrameKey {
    /// The SHA-256 of the encoded frame.
    pub(super) digest: String,
    /// True if the request named the model, which excludes a second model.
    pub(super) is_model_named: bool,
    /// The views of its camera.
    pub(super) rig: Arc<CameraRig>,
    /// The model of the first pass.
    pub(super) model: Arc<Model>,
}

/// The most recently requested frames with their detections.
pub(super) struct InferenceCache {
    max_frames: usize,
    /// The least recently used first.
    frames: Mutex<VecDeque<CachedFrame>>,
    hits: IntCounter,
}

struct CachedFrame {
    digest: String,
    is_model_named: bool,
    // Weak: an unused entry must not keep tables or weights in memory.
    rig: Weak<CameraRig>,
    passes: Vec<CachedPass>,
    bytes: usize,
}

struct CachedPass {
    /// The views of a later pass, owned by this entry alone; `None` for the camera's views.
    own_rig: Option<Arc<CameraRig>>,
    model: Weak<Model>,
    per_view: Vec<Vec<ViewDetection>>,
}

impl InferenceCache {
    /// Creates a cache of up to `max_frames` frames; 0 disables it. Counts the answers in `hits`.
    pub(super) fn new(max_frames: usize, hits: IntCounter) -> Self {
        Self {
            max_frames,
            frames: Mutex::default(),
            hits,
        }
    }

    /// Returns the passes of a cached frame, if all models of these passes are still `serving`.
    pub(super) fn lookup(
        &self,
        key: &FrameKey,
        serving: impl Fn(&Model) -> bool,
    ) -> Option<Vec<Pass>> {
        let mut frames = self.lock();
        let index = frames.iter().position(|frame| frame.is_of(key))?;
        let frame = frames.remove(index)?;
        let passes = frame.passes(&key.rig, serving)?;
        frames.push_back(frame);
        self.hits.inc();
        Some(passes)
    }

    /// Stores the passes of a frame and evicts the least recently used frames above the limits.
    pub(super) fn store(&self, key: FrameKey, passes: &[Pass]) {
        let frame = CachedFrame::new(key, passes);
        let mut frames = self.lock();
        frames.retain(|other| !other.is_like(&frame));
        frames.push_back(frame);
        while frames.len() > self.max_frames
            || frames.iter().map(|frame| frame.bytes).sum::<usize>() > MAX_BYTES
        {
            frames.pop_front();
        }
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<CachedFrame>> {
        // No change leaves a partial frame, so the list is consistent after a panic.
        self.frames.lock()
    }
}

impl CachedFrame {
    fn new(key: FrameKey, passes: &[Pass]) -> Self {
        let passes: Vec<_> = passes
            .iter()
            .map(|pass| CachedPass {
                own_rig: (!Arc::ptr_eq(&pass.rig, &key.rig)).then(|| Arc::clone(&pass.rig)),
                model: Arc::downgrade(&pass.model),
                per_view: pass.per_view.clone(),
            })
            .collect();
        Self {
            bytes: key.digest.len() + passes.iter().map(CachedPass::bytes).sum::<usize>(),
            digest: key.digest,
            is_model_named: key.is_model_named,
            rig: Arc::downgrade(&key.rig),
            passes,
        }
    }

    fn is_of(&self, key: &FrameKey) -> bool {
        let first = self.passes.first();
        self.digest == key.digest
            && self.is_model_named == key.is_model_named
            && std::ptr::eq(self.rig.as_ptr(), Arc::as_ptr(&key.rig))
            && first.is_some_and(|pass| std::ptr::eq(pass.model.as_ptr(), Arc::as_ptr(&key.model)))
    }

    fn is_like(&self, other: &Self) -> bool {
        let first = |frame: &Self| frame.passes.first().map(|pass| pass.model.as_ptr());
        self.digest == other.digest
            && self.is_model_named == other.is_model_named
            && self.rig.ptr_eq(&other.rig)
            && first(self) == first(other)
    }

    fn passes(&self, rig: &Arc<CameraRig>, serving: impl Fn(&Model) -> bool) -> Option<Vec<Pass>> {
        let passes = self.passes.iter().map(|pass| {
            Some(Pass {
                rig: Arc::clone(pass.own_rig.as_ref().unwrap_or(rig)),
                model: pass.model.upgrade().filter(|model| serving(model))?,
                per_view: pass.per_view.clone(),
            })
        });
        passes.collect()
    }
}

impl CachedPass {
    fn bytes(&self) -> usize {
        let detections: usize = self.per_view.iter().map(Vec::len).sum();
        let tables = self.own_rig.as_ref().map_or(0, |rig| rig.bytes());
        tables
            + detections * size_of::<ViewDetection>()
            + self.per_view.len() * size_of::<Vec<ViewDetection>>()
    }
}

//! What the network found in frames that somebody is still thinking about: asked for again with another
//! refinement, they need not be looked at again. Only frames whose request says so are remembered.

use std::{
    collections::VecDeque,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError, Weak,
        atomic::{AtomicU64, Ordering},
    },
};

use super::{camera_rig::CameraRig, pass::Pass};
use crate::inference::{Model, ViewDetection};

/// Most memory that all remembered frames may hold: finds, and the tables of closer passes.
const MAX_BYTES: usize = 32 << 20;

/// Which frame was looked at, and by whom.
#[derive(Clone)]
pub(super) struct FrameKey {
    /// The SHA-256 of the encoded frame.
    pub(super) digest: String,
    /// Whether the request named the model: only then a second opinion is not asked for.
    pub(super) is_model_named: bool,
    /// The views of its camera.
    pub(super) rig: Arc<CameraRig>,
    /// Who passes first.
    pub(super) model: Arc<Model>,
}

/// The frames that were asked for last.
pub(super) struct InferenceCache {
    max_frames: usize,
    /// The least recently used first.
    frames: Mutex<VecDeque<Remembered>>,
    recalled: AtomicU64,
}

struct Remembered {
    digest: String,
    is_model_named: bool,
    // Weak: what nobody uses any more must keep neither tables nor weights in memory.
    rig: Weak<CameraRig>,
    passes: Vec<RememberedLook>,
    bytes: usize,
}

struct RememberedLook {
    /// The views of a closer look, which nobody else holds; `None` for those of the camera.
    closer: Option<Arc<CameraRig>>,
    model: Weak<Model>,
    per_view: Vec<Vec<ViewDetection>>,
}

impl InferenceCache {
    /// Remembers up to `max_frames`; 0 for none.
    pub(super) fn new(max_frames: usize) -> Self {
        Self {
            max_frames,
            frames: Mutex::default(),
            recalled: AtomicU64::new(0),
        }
    }

    /// How many frames were recalled since the start.
    pub(super) fn recalled(&self) -> u64 {
        self.recalled.load(Ordering::Relaxed)
    }

    /// What was found in a frame, if it is remembered and all who looked are still `serving`.
    pub(super) fn recall(
        &self,
        key: &FrameKey,
        serving: impl Fn(&Model) -> bool,
    ) -> Option<Vec<Pass>> {
        let mut frames = self.lock();
        let place = frames.iter().position(|frame| frame.is_of(key))?;
        let frame = frames.remove(place)?;
        let passes = frame.passes(&key.rig, serving)?;
        frames.push_back(frame);
        self.recalled.fetch_add(1, Ordering::Relaxed);
        Some(passes)
    }

    /// Remembers what was found in a frame; others go where there is no room.
    pub(super) fn remember(&self, key: FrameKey, passes: &[Pass]) {
        let frame = Remembered::new(key, passes);
        let mut frames = self.lock();
        frames.retain(|other| !other.is_like(&frame));
        frames.push_back(frame);
        while frames.len() > self.max_frames
            || frames.iter().map(|frame| frame.bytes).sum::<usize>() > MAX_BYTES
        {
            frames.pop_front();
        }
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<Remembered>> {
        // Whatever was interrupted, each frame in the list is whole.
        self.frames.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Remembered {
    fn new(key: FrameKey, passes: &[Pass]) -> Self {
        let passes: Vec<_> = passes
            .iter()
            .map(|look| RememberedLook {
                closer: (!Arc::ptr_eq(&look.rig, &key.rig)).then(|| Arc::clone(&look.rig)),
                model: Arc::downgrade(&look.model),
                per_view: look.per_view.clone(),
            })
            .collect();
        Self {
            bytes: key.digest.len() + passes.iter().map(RememberedLook::bytes).sum::<usize>(),
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
            && first.is_some_and(|look| std::ptr::eq(look.model.as_ptr(), Arc::as_ptr(&key.model)))
    }

    fn is_like(&self, other: &Self) -> bool {
        let first = |frame: &Self| frame.passes.first().map(|look| look.model.as_ptr());
        self.digest == other.digest
            && self.is_model_named == other.is_model_named
            && self.rig.ptr_eq(&other.rig)
            && first(self) == first(other)
    }

    fn passes(&self, rig: &Arc<CameraRig>, serving: impl Fn(&Model) -> bool) -> Option<Vec<Pass>> {
        let passes = self.passes.iter().map(|look| {
            Some(Pass {
                rig: Arc::clone(look.closer.as_ref().unwrap_or(rig)),
                model: look.model.upgrade().filter(|model| serving(model))?,
                per_view: look.per_view.clone(),
            })
        });
        passes.collect()
    }
}

impl RememberedLook {
    fn bytes(&self) -> usize {
        let finds: usize = self.per_view.iter().map(Vec::len).sum();
        let tables = self.closer.as_ref().map_or(0, |rig| rig.bytes());
        tables
            + finds * size_of::<ViewDetection>()
            + self.per_view.len() * size_of::<Vec<ViewDetection>>()
    }
}

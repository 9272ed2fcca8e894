//! Views in which nothing moves: what was found in them is kept, so that a frame need not be looked
//! at again where it has not changed.
//!
//! A view is compared with how it looked when the network last saw it, not with the frame before:
//! changes too slow to notice add up. Whatever happens, a view is looked at again after
//! [`MAX_AGE`].

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError, Weak},
    time::{Duration, Instant},
};

use super::camera_rig::CameraRig;
use crate::{
    geometry::FrameCrop,
    imaging::ViewSignature,
    inference::{Model, ViewDetection},
};

/// Cameras remembered at most; the least recently seen go first.
const MAX_CAMERAS: usize = 256;
/// After this a view is looked at again, moved or not.
const MAX_AGE: Duration = Duration::from_secs(10);

/// What each camera saw last.
#[derive(Default)]
pub(super) struct MotionCache {
    cameras: Mutex<HashMap<String, Remembered>>,
}

struct Remembered {
    views: Arc<CameraViews>,
    /// The crops of the last second pass.
    crops: Option<CameraCrops>,
    last_used: Instant,
}

struct CameraCrops {
    crops: Vec<FrameCrop>,
    views: Arc<CameraViews>,
}

/// What one camera saw last, by the views of one rig and through one model.
pub(super) struct CameraViews {
    // Weak: a camera that is silent must keep neither tables nor weights in memory.
    rig: Weak<CameraRig>,
    model: Weak<Model>,
    views: Mutex<Vec<Option<SeenView>>>,
}

#[derive(Clone)]
struct SeenView {
    signature: ViewSignature,
    found: Vec<ViewDetection>,
    seen: Instant,
}

impl MotionCache {
    /// What this camera saw through these views and this model; nothing yet when it is new or they
    /// are others than last time.
    pub(super) fn of(
        &self,
        camera: &str,
        rig: &Arc<CameraRig>,
        model: &Arc<Model>,
    ) -> Arc<CameraViews> {
        let mut cameras = self.cameras.lock().unwrap_or_else(PoisonError::into_inner);
        let now = Instant::now();
        if let Some(known) = cameras.get_mut(camera)
            && known.views.are_of(rig, model)
        {
            known.last_used = now;
            return Arc::clone(&known.views);
        }
        if cameras.len() >= MAX_CAMERAS && !cameras.contains_key(camera) {
            let oldest = cameras.iter().min_by_key(|(_, known)| known.last_used);
            if let Some(oldest) = oldest.map(|(name, _)| name.clone()) {
                cameras.remove(&oldest);
            }
        }
        let views = Arc::new(CameraViews {
            rig: Arc::downgrade(rig),
            model: Arc::downgrade(model),
            views: Mutex::new((0..rig.view_count()).map(|_| None).collect()),
        });
        let entry = Remembered {
            views: Arc::clone(&views),
            crops: None,
            last_used: now,
        };
        cameras.insert(camera.to_owned(), entry);
        views
    }

    /// What this camera saw in crops that the last second pass had as well; `None` for a camera
    /// that is not remembered.
    pub(super) fn of_crops(
        &self,
        camera: &str,
        rig: &Arc<CameraRig>,
        model: &Arc<Model>,
    ) -> Option<Arc<CameraViews>> {
        let mut cameras = self.cameras.lock().unwrap_or_else(PoisonError::into_inner);
        let known = cameras.get_mut(camera)?;
        let before = known.crops.take();
        let before = before.filter(|before| before.views.are_of_model(model));
        let crops: Vec<FrameCrop> = rig.crops().copied().collect();
        let seen = crops.iter().map(|crop| {
            let before = before.as_ref()?;
            let same = before.crops.iter().position(|other| other == crop)?;
            before.views.lock()[same].clone()
        });
        let views = Arc::new(CameraViews {
            rig: Arc::downgrade(rig),
            model: Arc::downgrade(model),
            views: Mutex::new(seen.collect()),
        });
        known.crops = Some(CameraCrops {
            crops,
            views: Arc::clone(&views),
        });
        Some(views)
    }
}

impl CameraViews {
    fn are_of(&self, rig: &Arc<CameraRig>, model: &Arc<Model>) -> bool {
        std::ptr::eq(self.rig.as_ptr(), Arc::as_ptr(rig)) && self.are_of_model(model)
    }

    fn are_of_model(&self, model: &Arc<Model>) -> bool {
        std::ptr::eq(self.model.as_ptr(), Arc::as_ptr(model))
    }

    /// What was found in the view, if nothing has moved in it since.
    pub(super) fn still(
        &self,
        view: usize,
        signature: &ViewSignature,
    ) -> Option<Vec<ViewDetection>> {
        let views = self.lock();
        let seen = views[view].as_ref()?;
        let is_still = seen.seen.elapsed() < MAX_AGE && !seen.signature.differs_from(signature);
        is_still.then(|| seen.found.clone())
    }

    /// Keeps what was found in a view.
    pub(super) fn remember(
        &self,
        view: usize,
        signature: ViewSignature,
        found: Vec<ViewDetection>,
    ) {
        self.lock()[view] = Some(SeenView {
            signature,
            found,
            seen: Instant::now(),
        });
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Option<SeenView>>> {
        // Every change is a single assignment.
        self.views.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

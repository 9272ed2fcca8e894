//! The motion cache: detections of views without motion, so that unchanged views need no inference.
//!
//! A view is compared with its state at the last inference, not with the previous frame, so that
//! slow changes add up. After [`MAX_AGE`] inference always runs again.

use std::{
    sync::{Arc, Weak},
    time::{Duration, Instant},
};

use lookdown_lens::geometry::{FrameCrop, VirtualView};
use parking_lot::Mutex;

use super::{camera_cache::CameraCache, camera_rig::CameraRig};
use crate::inference::{Model, ViewDetection};
use lookdown_imaging::ViewSignature;

/// Maximum age of cached detections, with or without motion.
pub(super) const MAX_AGE: Duration = Duration::from_secs(10);

/// The latest detections of each camera.
#[derive(Default)]
pub(super) struct MotionCache(CameraCache<CachedCamera>);

struct CachedCamera {
    views: Arc<CameraViews>,
    /// The detail views of the last frame.
    details: ChangingViews<VirtualView>,
    /// The crops of the last frame for the network of the views, and for another one.
    floor_crops: ChangingViews<Vec<FrameCrop>>,
    crops: ChangingViews<Vec<FrameCrop>>,
}

/// The views of a pass that are other ones in each frame.
struct ChangingViews<V>(Mutex<Option<PlacedViews<V>>>);

struct PlacedViews<V> {
    places: Vec<V>,
    views: Arc<CameraViews>,
}

/// The latest detections of one camera, for the views of one rig and one model.
pub(super) struct CameraViews {
    // Weak: an inactive camera must not keep tables or weights in memory.
    rig: Weak<CameraRig>,
    model: Weak<Model>,
    // Every change is one assignment, so the state is consistent after a panic.
    views: Mutex<Vec<Option<CachedView>>>,
}

#[derive(Clone)]
struct CachedView {
    signature: ViewSignature,
    found: Vec<ViewDetection>,
    inferred_at: Instant,
}

impl MotionCache {
    /// Returns the cached views of a camera. They are empty if the camera is new or if its rig or
    /// its model has changed.
    pub(super) fn camera_views(
        &self,
        camera: &str,
        rig: &Arc<CameraRig>,
        model: &Arc<Model>,
    ) -> Arc<CameraViews> {
        let no_views = || CachedCamera {
            views: CameraViews::new(rig, model, vec![None; rig.view_count()]),
            details: ChangingViews(Mutex::default()),
            floor_crops: ChangingViews(Mutex::default()),
            crops: ChangingViews(Mutex::default()),
        };
        let is_stale = |known: &CachedCamera| !known.views.are_of(rig, model);
        let entry = self.0.get_or_renew(camera, no_views, is_stale);
        Arc::clone(&entry.views)
    }

    /// Forgets all views of a camera.
    pub(super) fn forget(&self, camera: &str) {
        self.0.remove(camera);
    }

    /// Returns the cached detail views of a camera, filled where the last frame had the same view.
    /// `None` if the camera is not in the cache.
    pub(super) fn detail_views(
        &self,
        camera: &str,
        rig: &Arc<CameraRig>,
        model: &Arc<Model>,
    ) -> Option<Arc<CameraViews>> {
        let views = rig.virtual_views().cloned().collect();
        let known = self.0.get(camera)?;
        Some(known.details.replace(views, rig, model))
    }

    /// Returns the cached crops of a camera, filled where the last frame had the same crop. `None`
    /// if the camera is not in the cache.
    pub(super) fn crop_views(
        &self,
        camera: &str,
        rig: &Arc<CameraRig>,
        model: &Arc<Model>,
    ) -> Option<Arc<CameraViews>> {
        let known = self.0.get(camera)?;
        let crops = if known.views.are_of_model(model) {
            &known.floor_crops
        } else {
            &known.crops
        };
        Some(crops.replace(rig.crops_of_inputs(), rig, model))
    }
}

impl<V: PartialEq> ChangingViews<V> {
    /// Replaces the views by those at `places`. Those that are the same keep what is cached.
    fn replace(
        &self,
        places: Vec<V>,
        rig: &Arc<CameraRig>,
        model: &Arc<Model>,
    ) -> Arc<CameraViews> {
        let mut last = self.0.lock();
        let before = last.take();
        let before = before.filter(|before| before.views.are_of_model(model));
        let cached = places.iter().map(|place| {
            let before = before.as_ref()?;
            let same = before.places.iter().position(|other| other == place)?;
            before.views.views.lock()[same].clone()
        });
        let views = CameraViews::new(rig, model, cached.collect());
        *last = Some(PlacedViews {
            places,
            views: Arc::clone(&views),
        });
        views
    }
}

impl CameraViews {
    fn new(rig: &Arc<CameraRig>, model: &Arc<Model>, views: Vec<Option<CachedView>>) -> Arc<Self> {
        Arc::new(Self {
            rig: Arc::downgrade(rig),
            model: Arc::downgrade(model),
            views: Mutex::new(views),
        })
    }

    fn are_of(&self, rig: &Arc<CameraRig>, model: &Arc<Model>) -> bool {
        std::ptr::eq(self.rig.as_ptr(), Arc::as_ptr(rig)) && self.are_of_model(model)
    }

    fn are_of_model(&self, model: &Arc<Model>) -> bool {
        std::ptr::eq(self.model.as_ptr(), Arc::as_ptr(model))
    }

    /// Returns the cached detections of a view, if nothing has moved in it since.
    pub(super) fn lookup(
        &self,
        view: usize,
        signature: &ViewSignature,
    ) -> Option<Vec<ViewDetection>> {
        let views = self.views.lock();
        let cached = views[view].as_ref()?;
        let is_fresh = cached.inferred_at.elapsed() < MAX_AGE;
        let is_still = is_fresh && !cached.signature.differs_from(signature);
        is_still.then(|| cached.found.clone())
    }

    /// Stores the detections of a view.
    pub(super) fn store(&self, view: usize, signature: ViewSignature, found: Vec<ViewDetection>) {
        self.views.lock()[view] = Some(CachedView {
            signature,
            found,
            inferred_at: Instant::now(),
        });
    }
}

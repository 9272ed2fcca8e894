//! The latest image of each camera that has one.

use std::{collections::HashMap, num::NonZeroUsize, sync::Arc};

use lookdown_common::OwnCameras;

use crate::{
    annotated_image::StoredFrame,
    results::{ReportId, StoredImage},
};

/// The images, at most `most`: the camera that was silent for longest is evicted first, and those
/// of this process last.
#[derive(Debug)]
pub(super) struct Images {
    most: NonZeroUsize,
    of_cameras: HashMap<String, Arc<StoredImage>>,
}

impl Images {
    pub(super) fn new(most: NonZeroUsize) -> Self {
        Self {
            most,
            of_cameras: HashMap::new(),
        }
    }

    /// Replaces the camera's image by that of the report with this ID, or removes it if that report
    /// has none.
    pub(super) fn replace(
        &mut self,
        camera: &str,
        id: ReportId,
        frame: Option<StoredFrame>,
        own: &OwnCameras,
    ) {
        let Some(frame) = frame else {
            return self.forget(camera);
        };
        let stored = Arc::new(StoredImage { id, frame });
        self.of_cameras.insert(camera.to_owned(), stored);
        while self.of_cameras.len() > self.most.get() {
            let images = self.of_cameras.iter();
            let oldest = images.min_by_key(|(camera, stored)| (own.contains(camera), stored.id));
            if let Some(camera) = oldest.map(|(camera, _)| camera.clone()) {
                self.of_cameras.remove(&camera);
            }
        }
    }

    pub(super) fn forget(&mut self, camera: &str) {
        self.of_cameras.remove(camera);
    }

    pub(super) fn for_camera(&self, camera: &str) -> Option<Arc<StoredImage>> {
        self.of_cameras.get(camera).cloned()
    }

    /// The number of images.
    pub(super) fn count(&self) -> usize {
        self.of_cameras.len()
    }
}

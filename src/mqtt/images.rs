//! The latest images of cameras, with boxes, and of their views: drawn one after the other, so that
//! neither their number nor a slow broker takes more than one thread.

use std::{collections::HashMap, sync::Arc, time::Duration};

use bytes::Bytes;
use tokio::{
    sync::mpsc,
    task::spawn_blocking,
    time::{MissedTickBehavior, interval},
};

use crate::{
    annotated_image::{AnnotationOptions, Layer},
    results::{ImagesOf, ReportId, ResultStore, StoredImage},
    views::{Rendering, Views},
};

/// The widest image, pixels.
const WIDTH: u32 = 1280;
const JPEG_QUALITY: u8 = 80;
/// Most bytes of an image. Larger ones are not published.
const MAX_BYTES: usize = 1 << 20;

/// An image of a camera, or of one of its views.
pub(super) struct CameraImage {
    pub(super) camera: String,
    pub(super) view: Option<String>,
    pub(super) jpeg: Bytes,
}

/// The tags of the published images of views, by name.
type ViewTags = HashMap<String, String>;

/// The images that are published.
pub(super) struct Images {
    pub(super) results: Arc<dyn ResultStore>,
    pub(super) views: Arc<Views>,
    pub(super) of: ImagesOf,
    /// Shortest time between two images of a camera.
    pub(super) every: Duration,
}

impl Images {
    /// Draws images and hands them over until the receiver is dropped. Waits while it is full.
    pub(super) async fn draw(&self, to: mpsc::Sender<CameraImage>) {
        let mut drawn = HashMap::<String, ReportId>::new();
        let mut tags = HashMap::<String, ViewTags>::new();
        let mut times = interval(self.every);
        times.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                _ = times.tick() => {}
                () = to.closed() => return,
            }
            // Without an answer, the next time decides.
            let cameras = self.results.cameras().await.unwrap_or_default();
            drawn.retain(|camera, _| cameras.contains(camera));
            tags.retain(|camera, _| cameras.contains(camera));
            for camera in cameras {
                if !self.of.include(&camera) {
                    continue;
                }
                if let Some(new) = self.draw_views(&camera, tags.get(&camera), &to).await {
                    tags.insert(camera.clone(), new);
                }
                let Ok(Some(stored)) = self.results.image(&camera).await else {
                    continue;
                };
                let before = drawn.insert(camera.clone(), stored.id);
                if before == Some(stored.id) {
                    continue;
                }
                // A frame that cannot be drawn is logged where it is requested.
                let Ok(Some(jpeg)) = spawn_blocking(move || image(&stored)).await else {
                    continue;
                };
                let image = CameraImage {
                    camera,
                    view: None,
                    jpeg,
                };
                if to.send(image).await.is_err() {
                    return;
                }
            }
        }
    }

    /// Renders the views of a camera whose image is another than before, and returns their tags.
    async fn draw_views(
        &self,
        camera: &str,
        before: Option<&ViewTags>,
        to: &mpsc::Sender<CameraImage>,
    ) -> Option<ViewTags> {
        let live = self.views.live(camera)?;
        let frame = live.frames().borrow().clone()?;
        let mut tags = ViewTags::new();
        for (name, view) in self.views.list(camera) {
            let rendering = Rendering::new(view);
            let tag = frame.tag(&rendering);
            let is_known = before.is_some_and(|before| before.get(&name) == Some(&tag));
            tags.insert(name.clone(), tag);
            if is_known {
                continue;
            }
            // A view that cannot be rendered is reported where it is requested.
            let jpeg = live.jpeg(&frame, &rendering).await.ok();
            if let Some(jpeg) = jpeg.filter(|jpeg| jpeg.len() <= MAX_BYTES) {
                let image = CameraImage {
                    camera: camera.to_owned(),
                    view: Some(name),
                    jpeg,
                };
                // The caller notes a receiver that is dropped.
                let _ = to.send(image).await;
            }
        }
        Some(tags)
    }
}

/// Returns the image that is published, if it is small enough.
fn image(stored: &StoredImage) -> Option<Bytes> {
    let options = AnnotationOptions {
        layers: vec![Layer::Oriented, Layer::Scores],
        width: WIDTH,
        quality: JPEG_QUALITY,
    };
    let jpeg = stored.frame.annotated(&options, &|| false).ok()?;
    (jpeg.len() <= MAX_BYTES).then(|| jpeg.into())
}

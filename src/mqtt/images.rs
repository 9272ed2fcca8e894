//! The latest images of cameras, with boxes: drawn one after the other, so that neither their
//! number nor a slow broker takes more than one thread.

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
};

/// The widest image, pixels.
const WIDTH: u32 = 1280;
const JPEG_QUALITY: u8 = 80;
/// Most bytes of an image. Larger ones are not published.
const MAX_BYTES: usize = 1 << 20;

/// An image of a camera.
pub(super) struct CameraImage {
    pub(super) camera: String,
    pub(super) jpeg: Bytes,
}

/// The images that are published.
pub(super) struct Images {
    pub(super) results: Arc<dyn ResultStore>,
    pub(super) of: ImagesOf,
    /// Shortest time between two images of a camera.
    pub(super) every: Duration,
}

impl Images {
    /// Draws images and hands them over until the receiver is dropped. Waits while it is full.
    pub(super) async fn draw(&self, to: mpsc::Sender<CameraImage>) {
        let mut drawn = HashMap::<String, ReportId>::new();
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
            for camera in cameras {
                if !self.of.include(&camera) {
                    continue;
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
                if to.send(CameraImage { camera, jpeg }).await.is_err() {
                    return;
                }
            }
        }
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

//! The viewers of cameras: while a camera has one, all of its frames are read and shown.

use std::{
    collections::HashMap,
    sync::{Arc, OnceLock},
    time::Duration,
};

use tokio::{sync::watch, time::sleep};

use crate::Frame;

/// The time after the last viewer for which a stream is still read as a whole: a page that is
/// loaded again does not restart its decoder.
const LINGER: Duration = Duration::from_secs(20);

type Show = Box<dyn Fn(&str, &Frame) + Send + Sync>;

/// The viewers of all cameras.
#[derive(Default)]
pub struct Viewers {
    /// The number of viewers of each camera that has any.
    counts: watch::Sender<HashMap<String, usize>>,
    show: OnceLock<Show>,
}

/// A viewer of a camera, until it is dropped.
pub struct Viewing {
    viewers: Arc<Viewers>,
    camera: String,
}

impl Viewers {
    /// Sets the function that gets each frame of the cameras with viewers. It must not block. Only
    /// the first call has an effect.
    pub fn show_with(&self, show: impl Fn(&str, &Frame) + Send + Sync + 'static) {
        let _ = self.show.set(Box::new(show));
    }

    /// Adds a viewer of a camera.
    pub fn add(self: &Arc<Self>, camera: &str) -> Viewing {
        self.counts.send_modify(|counts| {
            *counts.entry(camera.to_owned()).or_default() += 1;
        });
        Viewing {
            viewers: Arc::clone(self),
            camera: camera.to_owned(),
        }
    }

    pub(crate) fn has_any(&self, camera: &str) -> bool {
        self.counts.borrow().contains_key(camera)
    }

    /// Shows a frame, if its camera has viewers.
    pub(crate) fn offer(&self, camera: &str, frame: &Frame) {
        if let Some(show) = self.show.get().filter(|_| self.has_any(camera)) {
            show(camera, frame);
        }
    }

    /// Waits until a camera gets its first viewer, or has had none for a while.
    pub(crate) async fn changed(&self, camera: &str, had_any: bool) {
        let mut counts = self.counts.subscribe();
        loop {
            // The sender is `self`.
            let _ = counts
                .wait_for(|counts| counts.contains_key(camera) != had_any)
                .await;
            if !had_any {
                return;
            }
            sleep(LINGER).await;
            if !self.has_any(camera) {
                return;
            }
        }
    }
}

impl Drop for Viewing {
    fn drop(&mut self) {
        self.viewers.counts.send_modify(|counts| {
            if let Some(count) = counts.get_mut(&self.camera) {
                *count -= 1;
                if *count == 0 {
                    counts.remove(&self.camera);
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use bytes::Bytes;
    use jiff::Timestamp;
    use tokio::time::Instant;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn frames_are_shown_while_a_camera_has_viewers() {
        let (viewers, shown) = (Arc::new(Viewers::default()), Arc::new(AtomicUsize::new(0)));
        let counter = Arc::clone(&shown);
        viewers.show_with(move |camera, _| {
            assert_eq!(camera, "hall");
            counter.fetch_add(1, Ordering::Relaxed);
        });
        let jpeg = Bytes::from_static(b"\xff\xd8\xff\xe0..\xff\xd9");
        let frame = Frame::new(jpeg, Timestamp::UNIX_EPOCH).unwrap();
        viewers.offer("hall", &frame);
        let (first, second) = (viewers.add("hall"), viewers.add("hall"));
        viewers.changed("hall", false).await;
        for camera in ["hall", "gate"] {
            viewers.offer(camera, &frame);
        }
        drop(first);
        viewers.offer("hall", &frame);
        drop(second);
        viewers.offer("hall", &frame);
        assert_eq!(shown.load(Ordering::Relaxed), 2);
        let began = Instant::now();
        viewers.changed("hall", true).await;
        assert_eq!(began.elapsed(), LINGER);
    }
}

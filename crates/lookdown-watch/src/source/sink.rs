//! The receiver of a camera's frames.

use std::{
    sync::atomic::{AtomicUsize, Ordering},
    time::{Duration, Instant},
};

use bytes::Bytes;
use jiff::Timestamp;
use lookdown_common::LogOnce;
use parking_lot::Mutex;
use tokio::time::sleep;

use crate::{
    Frame, FrameError, SourceError,
    metrics::{CameraMetrics, Failure},
    slot::Slot,
};

/// Number of checks for a stalled source within its limit.
const STALL_CHECKS: u32 = 4;
/// Shortest time for the first frame: streams begin with a key frame.
const FIRST_FRAME: Duration = Duration::from_secs(10);

/// The receiver of a camera's frames.
pub(super) struct Sink<'a> {
    slot: &'a Slot<Frame>,
    /// The metrics of the camera, which know its viewers.
    pub(super) metrics: &'a CameraMetrics,
    started: Instant,
    /// The time of the last sign that the camera works.
    alive: Mutex<Option<Instant>>,
    is_failing: &'a Mutex<LogOnce>,
    /// The most bytes of a frame of a video that is accepted as pixels; 0 for JPEG files.
    most_pixel_bytes: &'a AtomicUsize,
}

impl<'a> Sink<'a> {
    /// Creates the receiver of one start of a source.
    pub(super) fn new(
        slot: &'a Slot<Frame>,
        metrics: &'a CameraMetrics,
        is_failing: &'a Mutex<LogOnce>,
        most_pixel_bytes: &'a AtomicUsize,
    ) -> Self {
        Self {
            slot,
            metrics,
            started: Instant::now(),
            alive: Mutex::default(),
            is_failing,
            most_pixel_bytes,
        }
    }

    /// Returns the most bytes of a frame of a video that is accepted as pixels; 0 for JPEG files.
    pub(super) fn most_pixel_bytes(&self) -> usize {
        self.most_pixel_bytes.load(Ordering::Relaxed)
    }

    /// Accepts JPEG files from now on, as a frame was too large for pixels. Returns false if it was
    /// a JPEG file already.
    pub(super) fn falls_back_to_files(&self) -> bool {
        self.most_pixel_bytes.swap(0, Ordering::Relaxed) > 0
    }

    /// Accepts an image file that was captured now.
    pub(super) fn accept(&self, image: Bytes) -> Result<(), FrameError> {
        self.accept_at(image, Timestamp::now())
    }

    /// Accepts an image file that was captured at this time. It replaces an older frame that was
    /// not sent yet.
    pub(super) fn accept_at(&self, image: Bytes, captured_at: Timestamp) -> Result<(), FrameError> {
        let frame = Frame::new(image, captured_at)
            .inspect_err(|_| self.metrics.failed(Failure::Damaged))?;
        self.metrics.received(&frame);
        self.alive();
        if self.slot.put(frame).is_some() {
            self.metrics.skipped.inc();
        }
        if self.is_failing.lock().clear() {
            tracing::info!("the camera sends frames again");
        }
        Ok(())
    }

    /// Notes that the camera works, although it sent no new frame.
    pub(super) fn alive(&self) {
        *self.alive.lock() = Some(Instant::now());
    }

    /// The time from the start to the last sign that the camera works.
    pub(super) fn lifetime(&self) -> Duration {
        let alive = *self.alive.lock();
        alive.map_or(Duration::ZERO, |alive| alive - self.started)
    }

    /// Waits until the camera showed no sign of work for this time.
    pub(super) async fn stalled(&self, limit: Duration) -> SourceError {
        loop {
            sleep(limit / STALL_CHECKS).await;
            let (since, limit) = match *self.alive.lock() {
                Some(alive) => (alive, limit),
                None => (self.started, limit.max(FIRST_FRAME)),
            };
            if since.elapsed() >= limit {
                return SourceError::Stalled(limit);
            }
        }
    }
}

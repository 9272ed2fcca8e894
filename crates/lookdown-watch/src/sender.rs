//! Sends the newest frame of a camera to the server at an interval.

use std::time::{Duration, Instant};

use tokio::time::{sleep, sleep_until};

use crate::{
    Camera, Frame,
    metrics::{CameraMetrics, Failure},
    pace::Pace,
    server::{Answer, Server},
    slot::Slot,
};
use lookdown_common::{Backoff, LogOnce};

/// First and longest pause after a failure of the server.
const PAUSES: (Duration, Duration) = (Duration::from_millis(250), Duration::from_secs(15));

/// Sends frames until the slot is closed.
pub(crate) async fn run(
    camera: &Camera,
    server: &Server,
    slot: &Slot<Frame>,
    metrics: &CameraMetrics,
) {
    let mut pace = Pace::new(camera.every);
    let (first, longest) = PAUSES;
    let mut backoff = Backoff::new(first, longest);
    let mut log = LogOnce::default();
    loop {
        if let Some(earliest) = pace.earliest() {
            sleep_until(earliest.into()).await;
        }
        let Some(frame) = slot.take().await else {
            return;
        };
        pace.sent(Instant::now());
        let (failure, message, pause) = match server.detect(camera, &frame).await {
            Answer::Report => {
                metrics.sent();
                backoff.reset();
                if log.clear() {
                    tracing::info!("the server accepts frames again");
                }
                continue;
            }
            Answer::Busy(message, pause) => {
                let backoff = backoff.next_pause();
                (Failure::Overloaded, message, pause.unwrap_or(backoff))
            }
            Answer::Refused(message) => (Failure::Refused, message, backoff.next_pause()),
            Answer::Failed(message) => (Failure::Unreachable, message, backoff.next_pause()),
        };
        metrics.failed(failure);
        if log.should_log(&message) {
            tracing::warn!("{message}");
        }
        sleep(pause).await;
    }
}

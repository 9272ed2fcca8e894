//! Sends the newest frame of a camera to the server at an interval.

use std::time::{Duration, Instant};

use tokio::time::{sleep, sleep_until};

use crate::{
    Camera, Frame, Location,
    metrics::{CameraMetrics, Failure},
    operating_point::Governor,
    pace::Pace,
    rate::RateMeter,
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
    let mut governor = Governor::new(&camera.operating_points, Instant::now());
    let mut pace = Pace::new(governor.every());
    let (first, longest) = PAUSES;
    let mut backoff = Backoff::new(first, longest);
    let mut log = LogOnce::default();
    let mut meter = RateMeter::new(governor.every(), metrics.received.get(), Instant::now());
    let mut is_slow = false;
    loop {
        if let Some(earliest) = pace.earliest() {
            sleep_until(earliest.into()).await;
        }
        let Some(frame) = slot.take().await else {
            return;
        };
        let sent_at = Instant::now();
        pace.sent(sent_at);
        let answer = server.detect(camera, governor.profile(), &frame).await;
        let now = Instant::now();
        let has_report = matches!(answer, Answer::Report(_));
        if let Some(rate) = meter.add(has_report, metrics.received.get(), now) {
            // A folder, and a snapshot that does not change, have no rate of their own.
            let has_own_rate = matches!(camera.location, Location::Rtsp(_));
            let warning = rate.warning();
            let warning = warning.filter(|_| rate.is_server_slow || has_own_rate);
            match &warning {
                Some(warning) if !is_slow => tracing::warn!("{warning}"),
                None if is_slow => tracing::info!("the wanted rate is reached again"),
                _ => {}
            }
            is_slow = warning.is_some();
            metrics.measured(rate, warning);
        }
        let (failure, message, pause) = match answer {
            Answer::Report(search) => {
                metrics.sent.inc();
                backoff.reset();
                if log.clear() {
                    tracing::info!("the server accepts frames again");
                }
                let Some(search) = search else {
                    continue;
                };
                if governor.record(search, now) {
                    pace = Pace::new(governor.every());
                    meter = RateMeter::new(governor.every(), metrics.received.get(), now);
                } else if let Some(choice) = governor.choice() {
                    metrics.chose(choice);
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

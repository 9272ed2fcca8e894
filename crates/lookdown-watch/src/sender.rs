//! Sends the newest frame of a camera to the server at an interval.

use std::time::{Duration, Instant};

use lookdown_common::{Backoff, LogOnce};
use tokio::time::{sleep, sleep_until};

use crate::{
    Camera, Frame, Location,
    metrics::{CameraMetrics, Failure},
    operating_point::Governor,
    rate::RateMeter,
    server::{Answer, Server},
    slot::Slot,
};

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

/// The part of the interval by which a frame may be sent early.
const TOLERANCE: u32 = 10;

/// Keeps the mean interval between two frames, although sources deliver them early or late.
#[derive(Debug)]
struct Pace {
    every: Duration,
    due: Option<Instant>,
}

impl Pace {
    pub(crate) fn new(every: Duration) -> Self {
        Self { every, due: None }
    }

    /// The earliest time for the next frame. `None` before the first frame.
    pub(crate) fn earliest(&self) -> Option<Instant> {
        self.due?.checked_sub(self.every / TOLERANCE)
    }

    /// Notes that a frame is being sent now.
    pub(crate) fn sent(&mut self, now: Instant) {
        let due = self.due.unwrap_or(now);
        // Time that was lost is not made up for.
        let is_late = now.saturating_duration_since(due) > self.every;
        self.due = Some(if is_late { now } else { due } + self.every);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVERY: Duration = Duration::from_secs(1);

    /// Sends the frames that arrive at these times in milliseconds, and returns the times of
    /// sending.
    fn sent(arrivals: impl Iterator<Item = u64>) -> Vec<u64> {
        let start = Instant::now();
        let mut pace = Pace::new(EVERY);
        let mut sent = Vec::new();
        for arrival in arrivals {
            let at = start + Duration::from_millis(arrival);
            if pace.earliest().is_none_or(|earliest| at >= earliest) {
                pace.sent(at);
                sent.push(arrival);
            }
        }
        sent
    }

    #[test]
    fn a_fast_source_is_sent_at_the_interval() {
        let sent = sent((0..100).map(|frame| frame * 40));
        assert_eq!(sent, [0, 920, 1920, 2920, 3920]);
    }

    #[test]
    fn jitter_of_a_source_costs_no_frame() {
        let jitter = [0, 30, 0, 60, 10, 0, 80, 20];
        let arrivals = jitter.iter().zip(0..).map(|(jitter, k)| k * 1000 + jitter);
        assert_eq!(sent(arrivals).len(), jitter.len());
    }

    #[test]
    fn lost_time_is_not_made_up_for() {
        let sent = sent([0, 1000, 7500].into_iter().chain((8..11).map(|s| s * 1000)));
        assert_eq!(sent, [0, 1000, 7500, 9000, 10_000]);
    }
}

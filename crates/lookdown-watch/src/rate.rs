//! The rate at which the frames of a camera become reports, minute by minute.

use std::time::{Duration, Instant};

/// Time over which frames are counted.
const WINDOW: Duration = Duration::from_mins(1);
/// The share of the wanted rate below which a camera is slow.
const SLOW_SHARE: f64 = 0.8;
/// The share of the time with a request in flight above which the server is the reason.
const BUSY_SHARE: f64 = 0.8;

/// The rate of the last whole minute.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// Frames per second that the settings want.
    pub wanted: f64,
    /// Frames per second with a report.
    pub reached: f64,
    /// True if less than 80 % is reached because the server is slow.
    pub is_server_slow: bool,
    /// True if less than 80 % is reached because the camera sends fewer frames.
    pub is_camera_slow: bool,
}

/// Counts the frames of a camera.
#[derive(Debug)]
pub(crate) struct RateMeter {
    every: Duration,
    began: Instant,
    sent: u32,
    busy: Duration,
}

impl RateMeter {
    pub(crate) fn new(every: Duration, now: Instant) -> Self {
        Self {
            every,
            began: now,
            sent: 0,
            busy: Duration::ZERO,
        }
    }

    /// Counts a frame whose request took `busy`. Returns the rate at the end of each minute.
    pub(crate) fn add(&mut self, has_report: bool, busy: Duration, now: Instant) -> Option<Rate> {
        self.sent += u32::from(has_report);
        self.busy += busy;
        let elapsed = now.duration_since(self.began).max(self.every);
        if elapsed < WINDOW {
            return None;
        }
        let wanted = self.every.as_secs_f64().recip();
        let reached = f64::from(self.sent) / elapsed.as_secs_f64();
        let is_slow = reached < SLOW_SHARE * wanted;
        let is_busy = self.busy.as_secs_f64() > BUSY_SHARE * elapsed.as_secs_f64();
        *self = Self::new(self.every, now);
        Some(Rate {
            wanted,
            reached,
            is_server_slow: is_slow && is_busy,
            is_camera_slow: is_slow && !is_busy,
        })
    }
}

impl Rate {
    /// Returns the sentence for the log, with the remedies; `None` if the rate is reached.
    pub(crate) fn warning(&self) -> Option<String> {
        let Self {
            wanted, reached, ..
        } = self;
        let remedies = if self.is_server_slow {
            "set a faster profile or a longer `every` for the camera, send fewer cameras to this \
             server, or give it more cores"
        } else if self.is_camera_slow {
            "raise the frame rate of the camera, or set a longer `every` for it"
        } else {
            return None;
        };
        let reason = if self.is_server_slow {
            "the server is slow"
        } else {
            "the camera sends fewer frames"
        };
        Some(format!(
            "{reached:.1} of {wanted:.1} frames per second become reports, as {reason}: {remedies}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends frames at this interval for two minutes, each of which takes `busy`.
    fn rates(interval: Duration, busy: Duration) -> Vec<Rate> {
        let start = Instant::now();
        let mut meter = RateMeter::new(Duration::from_millis(200), start);
        let frames = 1..=u32::try_from(121_000 / interval.as_millis()).unwrap();
        frames
            .filter_map(|frame| meter.add(true, busy, start + interval * frame))
            .collect()
    }

    #[test]
    fn a_slow_server_is_reported_with_its_remedies() {
        let millis = Duration::from_millis;
        let slow = rates(millis(312), millis(310));
        assert_eq!(slow.len(), 2);
        assert!(slow[0].is_server_slow && !slow[0].is_camera_slow);
        let warning = slow[0].warning().unwrap();
        assert!(
            warning.starts_with("3.2 of 5.0 frames per second"),
            "{warning}"
        );
        for remedy in ["faster profile", "longer `every`", "more cores"] {
            assert!(warning.contains(remedy), "{warning}");
        }
    }

    #[test]
    fn a_slow_camera_is_not_blamed_on_the_server() {
        let millis = Duration::from_millis;
        let slow = rates(millis(500), millis(100));
        assert!(slow[0].is_camera_slow && !slow[0].is_server_slow);
        assert!(
            slow[0]
                .warning()
                .unwrap()
                .contains("frame rate of the camera")
        );
        let reached = rates(millis(210), millis(150));
        assert_eq!(reached[0].warning(), None);
    }
}

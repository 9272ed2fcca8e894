//! The rate at which the frames of a camera become reports, minute by minute.

use std::time::{Duration, Instant};

/// Time over which frames are counted.
const WINDOW: Duration = Duration::from_mins(1);
/// The share of the wanted rate below which a camera is slow.
const SLOW_SHARE: f64 = 0.8;

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
    /// The frames that the source had delivered until then.
    received: u64,
    sent: u32,
}

impl RateMeter {
    /// Starts a minute. `received` is the number of frames that the source has delivered so far.
    pub(crate) fn new(every: Duration, received: u64, now: Instant) -> Self {
        Self {
            every,
            began: now,
            received,
            sent: 0,
        }
    }

    /// Counts a frame that was sent. Returns the rate at the end of each minute.
    pub(crate) fn add(&mut self, has_report: bool, received: u64, now: Instant) -> Option<Rate> {
        self.sent += u32::from(has_report);
        let elapsed = now.duration_since(self.began).max(self.every);
        if elapsed < WINDOW {
            return None;
        }
        let wanted = self.every.as_secs_f64().recip();
        let reached = f64::from(self.sent) / elapsed.as_secs_f64();
        let is_slow = reached < SLOW_SHARE * wanted;
        let delivered = u32::try_from(received - self.received).unwrap_or(u32::MAX);
        let has_frames = f64::from(delivered) / elapsed.as_secs_f64() >= SLOW_SHARE * wanted;
        *self = Self::new(self.every, received, now);
        Some(Rate {
            wanted,
            reached,
            is_server_slow: is_slow && has_frames,
            is_camera_slow: is_slow && !has_frames,
        })
    }
}

impl Rate {
    /// Returns the sentence for the log, with the remedies; `None` if the rate is reached.
    pub(crate) fn warning(&self) -> Option<String> {
        let (wanted, reached) = (self.wanted, self.reached);
        let (reason, remedies) = if self.is_server_slow {
            (
                "the machine is too slow",
                "set Rate and Profile of the camera to automatic (leave out `every` and `profile`); \
                 or send fewer cameras to this server, or give it more cores",
            )
        } else if self.is_camera_slow {
            (
                "the camera sends fewer frames",
                "raise the frame rate of the camera, or choose a lower Rate (`every`) for it",
            )
        } else {
            return None;
        };
        Some(format!(
            "{reached:.1} of {wanted:.1} frames per second become reports, so that counts may be too \
             low, as {reason}: {remedies}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends frames at this interval for two minutes, while the source delivers one at this other.
    fn rates(interval: Duration, delivered: Duration) -> Vec<Rate> {
        let start = Instant::now();
        let mut meter = RateMeter::new(Duration::from_millis(200), 0, start);
        let frames = 1..=u32::try_from(121_000 / interval.as_millis()).unwrap();
        frames
            .filter_map(|frame| {
                let elapsed = interval * frame;
                let received = elapsed.as_millis() / delivered.as_millis();
                meter.add(true, u64::try_from(received).unwrap(), start + elapsed)
            })
            .collect()
    }

    #[test]
    fn a_slow_server_is_reported_with_its_remedies() {
        let millis = Duration::from_millis;
        let slow = rates(millis(312), millis(200));
        assert_eq!(slow.len(), 2);
        assert!(slow[0].is_server_slow && !slow[0].is_camera_slow);
        let warning = slow[0].warning().unwrap();
        assert!(
            warning.starts_with("3.2 of 5.0 frames per second"),
            "{warning}"
        );
        for remedy in ["Rate and Profile", "automatic", "more cores"] {
            assert!(warning.contains(remedy), "{warning}");
        }
    }

    #[test]
    fn a_slow_camera_is_not_blamed_on_the_server() {
        let millis = Duration::from_millis;
        let slow = rates(millis(500), millis(500));
        assert!(slow[0].is_camera_slow && !slow[0].is_server_slow);
        assert!(
            slow[0]
                .warning()
                .unwrap()
                .contains("frame rate of the camera")
        );
        let reached = rates(millis(210), millis(200));
        assert_eq!(reached[0].warning(), None);
    }
}

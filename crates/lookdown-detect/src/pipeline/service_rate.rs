//! The rate at which frames are served, from which `Retry-After` of a refused request is estimated.

use std::time::{Duration, Instant};

/// The weight of the newest interval in the moving average. Intervals ten frames back hardly count.
const NEWEST_WEIGHT: f64 = 0.2;

/// Measures the time between the ends of two frames while there is work.
#[derive(Debug, Default)]
pub(super) struct ServiceRate {
    /// The start of the current interval: the end of the last frame, or the arrival of work.
    waiting_since: Option<Instant>,
    /// Mean seconds per frame.
    seconds_per_frame: Option<f64>,
}

impl ServiceRate {
    /// Records that a frame arrived.
    pub(super) fn began(&mut self, now: Instant) {
        self.waiting_since.get_or_insert(now);
    }

    /// Records that a frame was served, with `pending` other frames left.
    pub(super) fn ended(&mut self, now: Instant, pending: usize) {
        let since = self.waiting_since.take().unwrap_or(now);
        let seconds = now.saturating_duration_since(since).as_secs_f64();
        let mean = self.seconds_per_frame.unwrap_or(seconds);
        self.seconds_per_frame = Some(mean + (seconds - mean) * NEWEST_WEIGHT);
        if pending > 0 {
            self.waiting_since = Some(now);
        }
    }

    /// Records that a frame was withdrawn, with `pending` other frames left.
    pub(super) fn given_up(&mut self, pending: usize) {
        if pending == 0 {
            self.waiting_since = None;
        }
    }

    /// Estimates the time to serve `frames`. Returns zero before the first frame is served.
    pub(super) fn time_for(&self, frames: usize) -> Duration {
        let count = u32::try_from(frames).unwrap_or(u32::MAX);
        let seconds = self.seconds_per_frame.unwrap_or(0.0) * f64::from(count);
        Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn time_without_work_does_not_count() {
        let (mut rate, start) = (ServiceRate::default(), Instant::now());
        rate.began(start);
        rate.ended(start + SECOND, 0);
        // An hour without a frame.
        let later = start + SECOND * 3600;
        rate.began(later);
        rate.ended(later + SECOND, 0);
        assert_eq!(rate.time_for(8), 8 * SECOND);
    }

    #[test]
    fn a_withdrawn_frame_starts_no_interval() {
        let (mut rate, start) = (ServiceRate::default(), Instant::now());
        rate.began(start);
        rate.given_up(0);
        let later = start + SECOND * 3600;
        rate.began(later);
        rate.ended(later + SECOND, 0);
        assert_eq!(rate.time_for(1), SECOND);
    }

    #[test]
    fn frames_served_in_parallel_count_by_their_ends() {
        let (mut rate, start) = (ServiceRate::default(), Instant::now());
        for _ in 0..4 {
            rate.began(start);
        }
        for frame in 1..=4_u32 {
            rate.ended(start + SECOND / 2 * frame, 4 - frame as usize);
        }
        assert_eq!(rate.time_for(4), 2 * SECOND);
    }

    #[test]
    fn the_estimate_follows_when_frames_become_slower() {
        let (mut rate, start) = (ServiceRate::default(), Instant::now());
        rate.began(start);
        let mut now = start;
        for step in [SECOND; 3].into_iter().chain([4 * SECOND; 20]) {
            now += step;
            rate.ended(now, 1);
        }
        let estimate = rate.time_for(1).as_secs_f64();
        assert!((3.9..4.0).contains(&estimate), "{estimate}");
    }
}

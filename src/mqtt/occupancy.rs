//! The occupancy of a camera or a zone: on with the first person, off only after some time without
//! one, so that it does not change with every person that a frame misses.

use std::time::Duration;

use tokio::time::Instant;

/// The payloads of occupancy topics.
pub(super) const ON: &str = "ON";
pub(super) const OFF: &str = "OFF";

/// The presence of persons.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Occupancy {
    is_on: bool,
    /// The time at which it becomes off, unless a person is reported before.
    pub(super) off_at: Option<Instant>,
}

impl Occupancy {
    /// Updates it with the number of persons of a frame.
    pub(super) fn update(&mut self, persons: usize, now: Instant, hold: Duration) {
        if persons > 0 {
            (self.is_on, self.off_at) = (true, None);
        } else if self.is_on {
            self.off_at.get_or_insert(now + hold);
            self.expire(now);
        }
    }

    /// Ends a hold that is over. Returns true if the occupancy has changed.
    pub(super) fn expire(&mut self, now: Instant) -> bool {
        let is_over = self.off_at.is_some_and(|off_at| off_at <= now);
        if is_over {
            *self = Self::default();
        }
        is_over
    }

    /// The payload of its topic.
    pub(super) fn payload(self) -> &'static str {
        if self.is_on { ON } else { OFF }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOLD: Duration = Duration::from_secs(5);

    #[test]
    fn missed_persons_within_the_hold_change_nothing() {
        let (begin, mut occupancy) = (Instant::now(), Occupancy::default());
        let after = |seconds| begin + Duration::from_secs(seconds);
        occupancy.update(0, begin, HOLD);
        assert_eq!((occupancy.payload(), occupancy.off_at), (OFF, None));
        occupancy.update(2, after(1), HOLD);
        occupancy.update(0, after(2), HOLD);
        occupancy.update(0, after(4), HOLD);
        assert_eq!(occupancy.payload(), ON);
        assert_eq!(occupancy.off_at, Some(after(7)));
        assert!(!occupancy.expire(after(6)));
        occupancy.update(1, after(6), HOLD);
        assert_eq!((occupancy.payload(), occupancy.off_at), (ON, None));
        occupancy.update(0, after(8), HOLD);
        assert!(occupancy.expire(after(13)));
        assert_eq!((occupancy.payload(), occupancy.off_at), (OFF, None));
    }

    #[test]
    fn without_a_hold_it_follows_each_frame() {
        let (now, mut occupancy) = (Instant::now(), Occupancy::default());
        occupancy.update(1, now, Duration::ZERO);
        assert_eq!(occupancy.payload(), ON);
        occupancy.update(0, now, Duration::ZERO);
        assert_eq!(occupancy.payload(), OFF);
    }
}

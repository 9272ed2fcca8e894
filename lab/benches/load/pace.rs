//! The due times of requests.

use std::time::Duration;

use clap::ValueEnum;
use tokio::time::Instant;

/// The distribution of the requests of an open loop.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Arrivals {
    /// A Poisson process, as of many independent clients.
    Poisson,
    /// Regular intervals.
    Constant,
}

/// The due times of the requests of all clients together.
pub struct Pace {
    schedule: Option<Schedule>,
    end: Instant,
}

struct Schedule {
    rate: f64,
    arrivals: Arrivals,
    next: Instant,
    random: u64,
}

impl Pace {
    /// Requests are due at once, until `end`.
    pub fn closed(end: Instant) -> Self {
        Self {
            schedule: None,
            end,
        }
    }

    /// `rate` requests per second are due from `start` to `end`.
    pub fn open(rate: f64, arrivals: Arrivals, start: Instant, end: Instant) -> Self {
        let schedule = Schedule {
            rate,
            arrivals,
            next: start,
            random: 0,
        };
        Self {
            schedule: Some(schedule),
            end,
        }
    }

    /// Takes the due time of the next request; `None` after the last one.
    pub fn take(&mut self) -> Option<Instant> {
        let due = match &mut self.schedule {
            None => Instant::now(),
            Some(schedule) => {
                let gap = schedule.gap();
                schedule.next += gap;
                schedule.next
            }
        };
        (due < self.end).then_some(due)
    }
}

impl Schedule {
    fn gap(&mut self) -> Duration {
        let gaps = match self.arrivals {
            Arrivals::Constant => 1.0,
            // Gaps between the events of a Poisson process are exponentially distributed.
            Arrivals::Poisson => -(1.0 - self.uniform()).ln(),
        };
        Duration::from_secs_f64(gaps / self.rate)
    }

    /// A number from 0 to below 1, reproducible: the generator `SplitMix64` (Steele et al., "Fast
    /// splittable pseudorandom number generators", OOPSLA 2014).
    fn uniform(&mut self) -> f64 {
        self.random = self.random.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.random;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        let upper = ((mixed ^ (mixed >> 31)) >> 32) as u32;
        f64::from(upper) / (f64::from(u32::MAX) + 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_kinds_of_arrivals_keep_the_rate() {
        for arrivals in [Arrivals::Poisson, Arrivals::Constant] {
            let start = Instant::now();
            let mut pace = Pace::open(100.0, arrivals, start, start + Duration::from_secs(100));
            let count = std::iter::from_fn(|| pace.take()).count();
            // The standard deviation of a Poisson process is 100 here.
            assert!((9_600..=10_400).contains(&count), "{count}");
        }
    }

    #[test]
    fn a_closed_loop_ends() {
        assert!(Pace::closed(Instant::now()).take().is_none());
    }
}

//! Statistics of the requests, in bounded memory.

use std::{collections::BTreeMap, ops::Range, time::Duration};

use hyper::StatusCode;
use serde_json::{Value, json};
use tokio::time::Instant;

/// The relative resolution of latencies.
const RESOLUTION: f64 = 0.005;
/// The shortest latency with a class of its own, seconds.
const SHORTEST: f64 = 1e-4;

/// The outcome of a request.
pub enum Outcome {
    /// The complete response, with its number of bytes.
    Answered(StatusCode, usize),
    /// No connection, or a broken one.
    Broken,
    /// The response timed out.
    TimedOut,
}

/// Counts the outcomes of the requests of a time span.
pub struct Tally {
    counted: Range<Instant>,
    open: bool,
    statuses: BTreeMap<u16, u64>,
    in_time: u64,
    broken: u64,
    timed_out: u64,
    succeeded: Latencies,
    refused: Latencies,
    sent: u64,
    received: u64,
    succeeded_in_all: u64,
}

impl Tally {
    /// Counts the requests that are due (open loop) or end (closed loop) in the time `counted`.
    pub fn new(counted: Range<Instant>, open: bool) -> Self {
        Self {
            counted,
            open,
            statuses: BTreeMap::new(),
            in_time: 0,
            broken: 0,
            timed_out: 0,
            succeeded: Latencies::default(),
            refused: Latencies::default(),
            sent: 0,
            received: 0,
            succeeded_in_all: 0,
        }
    }

    /// Records the outcome of a request with a body of `sent` bytes that has just ended.
    pub fn note(&mut self, due: Instant, outcome: &Outcome, sent: usize) {
        let now = Instant::now();
        let succeeded = matches!(outcome, Outcome::Answered(status, _) if status.is_success());
        self.succeeded_in_all += u64::from(succeeded);
        self.in_time += u64::from(succeeded && self.counted.contains(&now));
        if !self.counted.contains(if self.open { &due } else { &now }) {
            return;
        }
        self.sent += sent as u64;
        match outcome {
            Outcome::Broken => self.broken += 1,
            Outcome::TimedOut => self.timed_out += 1,
            Outcome::Answered(status, bytes) => {
                self.received += *bytes as u64;
                *self.statuses.entry(status.as_u16()).or_default() += 1;
                match status.as_u16() {
                    200..=299 => self.succeeded.note(now - due),
                    429 | 503 => self.refused.note(now - due),
                    _ => {}
                }
            }
        }
    }

    /// Returns all statistics as JSON.
    pub fn summary(&self) -> Value {
        let seconds = (self.counted.end - self.counted.start).as_secs_f64();
        let per_second = self.in_time as f64 / seconds;
        json!({
            "seconds": seconds,
            "statuses": self.statuses,
            "succeeded_per_second": per_second,
            "succeeded_in_all": self.succeeded_in_all,
            "succeeded": self.succeeded.summary(),
            "refused": self.refused.summary(),
            "broken": self.broken,
            "timed_out": self.timed_out,
            "bytes_sent": self.sent,
            "bytes_received": self.received,
        })
    }
}

/// A histogram of latencies whose classes grow by [`RESOLUTION`].
#[derive(Default)]
struct Latencies {
    counts: BTreeMap<u32, u64>,
    count: u64,
    longest: Duration,
}

impl Latencies {
    fn note(&mut self, latency: Duration) {
        let ratio = (latency.as_secs_f64() / SHORTEST).max(1.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "from 0 to a few thousand"
        )]
        let class = (ratio.ln() / RESOLUTION.ln_1p()) as u32;
        *self.counts.entry(class).or_default() += 1;
        self.count += 1;
        self.longest = self.longest.max(latency);
    }

    /// The latency that this fraction of the requests did not exceed, milliseconds.
    fn quantile(&self, share: f64) -> f64 {
        let longest = self.longest.as_secs_f64();
        let mut seen = 0;
        for (class, count) in &self.counts {
            seen += count;
            if seen as f64 >= share * self.count as f64 {
                let middle = SHORTEST * (1.0 + RESOLUTION).powf(f64::from(*class) + 0.5);
                return middle.min(longest) * 1e3;
            }
        }
        longest * 1e3
    }

    fn summary(&self) -> Value {
        if self.count == 0 {
            return json!({ "count": 0 });
        }
        json!({
            "count": self.count,
            "p50_ms": self.quantile(0.5),
            "p95_ms": self.quantile(0.95),
            "p99_ms": self.quantile(0.99),
            "max_ms": self.longest.as_secs_f64() * 1e3,
        })
    }
}

#[cfg(test)]
mod tests {

    use super::*;

    fn latencies(milliseconds: impl IntoIterator<Item = u64>) -> Latencies {
        let mut latencies = Latencies::default();
        for latency in milliseconds {
            latencies.note(Duration::from_millis(latency));
        }
        latencies
    }

    #[test]
    fn quantiles_are_true_to_half_a_percent() {
        let latencies = latencies(1..=1000);
        for (share, truth) in [(0.5, 500.0), (0.95, 950.0), (0.99, 990.0)] {
            let found = latencies.quantile(share);
            assert!((found / truth - 1.0).abs() <= RESOLUTION, "{found}");
        }
    }

    #[test]
    fn no_quantile_exceeds_the_longest_latency() {
        assert!(latencies([7]).quantile(0.99) <= 7.0);
    }

    #[test]
    fn refusals_are_kept_apart_and_what_came_early_is_not_counted() {
        let now = Instant::now();
        let early = now.checked_sub(Duration::from_secs(1)).unwrap_or(now);
        let mut tally = Tally::new(now..now + Duration::from_secs(10), true);
        tally.note(now, &Outcome::Answered(StatusCode::OK, 5), 3);
        tally.note(now, &Outcome::Answered(StatusCode::TOO_MANY_REQUESTS, 5), 3);
        tally.note(early, &Outcome::Answered(StatusCode::OK, 5), 3);
        let summary = tally.summary();
        assert_eq!(summary["statuses"], json!({ "200": 1, "429": 1 }));
        assert_eq!(summary["refused"]["count"], 1);
        assert_eq!(summary["succeeded_in_all"], 2);
    }
}

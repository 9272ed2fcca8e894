//! Evidence that a track is a person: a sequential probability ratio test.
//!
//! The track score of Blackman and Popoli, "Design and Analysis of Modern Tracking Systems" (1999),
//! section 6.2: logarithms of likelihood ratios add up. The score of a person is a probability, so
//! its log odds are what one person adds. Errors of frames in quick succession are alike, so a report
//! counts by the time since the camera's last one.

use serde::{Deserialize, Serialize};

/// The settings of the test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EvidenceSettings {
    /// Added to the log odds of the first person: most persons without a track are false.
    pub start: f64,
    /// Added to the log odds of each further person: it is where the track expects it.
    pub hit: f64,
    /// Added for a report without a person.
    pub miss: f64,
    /// A track is confirmed from this sum on.
    pub confirm: f64,
    /// A track ends below this sum.
    pub end: f64,
    /// The sum is kept below this.
    pub most: f64,
    /// Frames nearer in time count less, seconds.
    pub independent_s: f64,
}

impl Default for EvidenceSettings {
    fn default() -> Self {
        Self {
            start: -0.9,
            hit: 1.05,
            miss: -1.7,
            confirm: 3.6,
            end: -3.0,
            most: 8.0,
            independent_s: 0.3,
        }
    }
}

/// Least and greatest log odds of one person: scores of .02 and .98.
const SCORE_LIMIT: f64 = 3.9;

/// The sum of the evidence of a track.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Evidence(f64);

impl Evidence {
    /// Returns the evidence of a track's first person.
    pub fn first(score: f64, settings: &EvidenceSettings) -> Self {
        Self(log_odds(score) + settings.start)
    }

    /// Adds a person seen `interval_s` after the camera's last report.
    pub fn add_hit(&mut self, score: f64, interval_s: f64, settings: &EvidenceSettings) {
        let added = log_odds(score) + settings.hit;
        self.0 = (self.0 + added * weight(interval_s, settings)).min(settings.most);
    }

    /// Adds a report without the person, `interval_s` after the camera's last one.
    pub fn add_miss(&mut self, interval_s: f64, settings: &EvidenceSettings) {
        self.0 += settings.miss * weight(interval_s, settings);
    }

    /// Returns the logarithm of the probability that the track is a person who is still there.
    pub fn log_probability(self) -> f64 {
        -(-self.0).exp().ln_1p()
    }

    /// Returns true when the track is a person.
    pub fn confirms(self, settings: &EvidenceSettings) -> bool {
        self.0 >= settings.confirm
    }

    /// Returns true when the track is none.
    pub fn refutes(self, settings: &EvidenceSettings) -> bool {
        self.0 < settings.end
    }
}

fn weight(interval_s: f64, settings: &EvidenceSettings) -> f64 {
    (interval_s / settings.independent_s).clamp(0.0, 1.0)
}

/// Returns the log odds of a score, within limits.
pub(super) fn log_odds(score: f64) -> f64 {
    let odds = score / (1.0 - score);
    odds.ln().clamp(-SCORE_LIMIT, SCORE_LIMIT)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(hits: u32, misses: u32, interval_s: f64) -> Evidence {
        let settings = EvidenceSettings::default();
        let mut evidence = Evidence::first(0.9, &settings);
        for _ in 0..hits {
            evidence.add_hit(0.9, interval_s, &settings);
        }
        for _ in 0..misses {
            evidence.add_miss(interval_s, &settings);
        }
        evidence
    }

    #[test]
    fn one_clear_person_a_second_confirms_at_the_second() {
        let settings = EvidenceSettings::default();
        assert!(!after(0, 0, 1.0).confirms(&settings));
        assert!(after(1, 0, 1.0).confirms(&settings));
    }

    #[test]
    fn frames_in_quick_succession_count_less() {
        let settings = EvidenceSettings::default();
        assert!(!after(1, 0, 0.1).confirms(&settings));
        assert!(after(3, 0, 0.1).confirms(&settings));
    }

    #[test]
    fn misses_refute_a_track() {
        let settings = EvidenceSettings::default();
        assert!(!after(3, 4, 1.0).refutes(&settings));
        assert!(after(3, 7, 1.0).refutes(&settings));
        assert!(after(3, 7, 1.0).log_probability() < after(3, 0, 1.0).log_probability());
    }

    #[test]
    fn scores_of_zero_and_one_are_finite() {
        assert_eq!(log_odds(0.0), -SCORE_LIMIT);
        assert_eq!(log_odds(1.0), SCORE_LIMIT);
    }
}

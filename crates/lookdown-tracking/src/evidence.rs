//! Evidence that a track is a person: a sequential probability ratio test.
//!
//! The track score of Blackman and Popoli, "Design and Analysis of Modern Tracking Systems" (1999),
//! section 6.2: logarithms of likelihood ratios add up. The score of a person is a probability, so
//! its log odds are what one person adds. But only independent errors add up:
//!
//! * Frames in quick succession are alike, so a report counts by the time since the camera's last
//!   one.
//! * A thing that stands still looks the same in every frame. However often it is seen, it counts
//!   as a few reports of its mean score, and what it did before fades. A poster with a score of .3
//!   thus never becomes a person, not even when the track of a passer-by stays on it.
//!
//! A thing with a higher score is a person for this test. What stands for hours is left to
//! [`furniture`](crate::furniture), which continues with tracks that never left their first place.

use serde::{Deserialize, Serialize};

/// The settings of the test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EvidenceSettings {
    /// Added to the log odds of the first person: most persons without a track are false.
    pub start: f64,
    /// The time between reports for which that holds, seconds.
    pub start_interval_s: f64,
    /// Added to the log odds of each further person: it is where the track expects it.
    pub hit: f64,
    /// Added for a report without a person.
    pub miss: f64,
    /// A track is confirmed from this sum on.
    pub confirm: f64,
    /// A confirmed track ends below this sum of the reports that it was seen in.
    pub revoke: f64,
    /// A track that is not confirmed ends below this sum.
    pub end: f64,
    /// The sum is kept below this.
    pub most: f64,
    /// Frames nearer in time count less, seconds.
    pub independent_s: f64,
    /// Most reports that count at one place.
    pub reports_of_place: f64,
    /// Reports after which the mean at one place, and what counted before, fade (by a factor of e).
    pub memory: f64,
}

impl Default for EvidenceSettings {
    fn default() -> Self {
        Self {
            start: -0.9,
            start_interval_s: 0.2,
            hit: 1.0,
            miss: -1.2,
            confirm: 3.6,
            revoke: 1.0,
            end: -3.0,
            most: 8.0,
            independent_s: 0.3,
            reports_of_place: 3.0,
            memory: 20.0,
        }
    }
}

/// Least and greatest log odds of one person: scores of .02 and .98.
const SCORE_LIMIT: f64 = 3.9;

/// Most times `start_interval_s` that a pause between reports counts. Like that interval a guess,
/// checked on the walks of `docs/lab/real-walks.md`.
const MOST_ARRIVALS: f64 = 10.0;

/// The evidence of a track.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Evidence {
    /// Sum of the places that the track has left.
    before: f64,
    /// Mean of the reports at the present place.
    mean: f64,
    /// Number of those reports, weighted by time.
    reports: f64,
    /// Number of reports since the last person, weighted by time.
    missed: f64,
}

impl Evidence {
    /// Returns the evidence of a track's first person, seen `unwatched_s` after the last report.
    /// The number of people who arrive grows with that time, that of false boxes does not.
    pub fn first(score: f64, unwatched_s: f64, settings: &EvidenceSettings) -> Self {
        let arrivals = (unwatched_s / settings.start_interval_s).clamp(1.0, MOST_ARRIVALS);
        Self {
            before: log_odds(score) + settings.start + arrivals.ln(),
            mean: 0.0,
            reports: 0.0,
            missed: 0.0,
        }
    }

    /// Adds a person seen `interval_s` after the camera's last report.
    pub fn add_hit(&mut self, score: f64, interval_s: f64, settings: &EvidenceSettings) {
        let missed = std::mem::take(&mut self.missed);
        self.add(settings.miss, missed, settings);
        let added = log_odds(score) + settings.hit;
        self.add(added, weight(interval_s, settings), settings);
        self.before -= self.before * weight(interval_s, settings) / settings.memory;
        let over = self.seen(settings) - settings.most;
        self.before -= over.max(0.0);
    }

    /// Adds a report without the person, `interval_s` after the camera's last one.
    pub fn add_miss(&mut self, interval_s: f64, settings: &EvidenceSettings) {
        self.missed += weight(interval_s, settings);
    }

    /// The track has moved to another place, where its person looks different.
    pub fn move_on(&mut self, settings: &EvidenceSettings) {
        self.before = self.seen(settings);
        (self.mean, self.reports) = (0.0, 0.0);
    }

    /// Returns the logarithm of the probability that the track is a person who is still there. It
    /// falls no further than the evidence at which a new track ends: a person may come back.
    pub fn log_probability(self, settings: &EvidenceSettings) -> f64 {
        -(-self.sum(settings).max(settings.end)).exp().ln_1p()
    }

    /// Returns true when the track is a person.
    pub fn confirms(self, settings: &EvidenceSettings) -> bool {
        self.sum(settings) >= settings.confirm
    }

    /// Returns true when a confirmed track is not a person after all.
    pub fn revokes(self, settings: &EvidenceSettings) -> bool {
        self.seen(settings) < settings.revoke
    }

    /// Returns true when the track is none.
    pub fn refutes(self, settings: &EvidenceSettings) -> bool {
        self.sum(settings) < settings.end
    }

    fn add(&mut self, value: f64, weight: f64, settings: &EvidenceSettings) {
        if weight > 0.0 {
            self.reports = (self.reports + weight).min(settings.memory);
            self.mean += (value - self.mean) * (weight / self.reports).min(1.0);
        }
    }

    /// The evidence up to the last person.
    fn seen(self, settings: &EvidenceSettings) -> f64 {
        self.before + self.mean * self.reports.min(settings.reports_of_place)
    }

    /// The evidence up to the last report.
    fn sum(self, settings: &EvidenceSettings) -> f64 {
        self.seen(settings) + settings.miss * self.missed
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
        let mut evidence = Evidence::first(0.9, interval_s, &settings);
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
    fn who_appears_after_a_pause_is_likelier_a_person() {
        let settings = EvidenceSettings::default();
        let confirms = |pause_s| Evidence::first(0.97, pause_s, &settings).confirms(&settings);
        assert!(!confirms(0.2));
        assert!(confirms(1.5) && confirms(60.0));
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
        assert!(!after(3, 6, 1.0).refutes(&settings));
        assert!(after(3, 12, 1.0).refutes(&settings));
        let probability = |misses| after(3, misses, 1.0).log_probability(&settings);
        assert!(probability(12) < probability(0));
    }

    /// The evidence of 100 reports of a thing that stands still, and of one that walks.
    fn from_score(score: f64) -> [Evidence; 2] {
        let settings = EvidenceSettings::default();
        [false, true].map(|walks| {
            let mut evidence = Evidence::first(score, 0.2, &settings);
            for _ in 0..100 {
                evidence.add_hit(score, 1.0, &settings);
                if walks {
                    evidence.move_on(&settings);
                }
            }
            evidence
        })
    }

    #[test]
    fn low_scores_confirm_what_walks_and_not_what_stands() {
        let settings = EvidenceSettings::default();
        let [standing, walking] = from_score(0.35);
        assert!(!standing.confirms(&settings) && walking.confirms(&settings));
        let [standing, _] = from_score(0.6);
        assert!(standing.confirms(&settings));
    }

    #[test]
    fn a_person_who_walked_there_needs_a_score_of_a_third() {
        let settings = EvidenceSettings::default();
        for (score, remains) in [(0.25, false), (0.4, true)] {
            let mut evidence = after(10, 0, 1.0);
            evidence.move_on(&settings);
            for _ in 0..1000 {
                evidence.add_hit(score, 1.0, &settings);
            }
            assert_eq!(!evidence.revokes(&settings), remains, "{score}");
        }
    }

    #[test]
    fn a_short_drop_of_the_score_revokes_nothing() {
        let settings = EvidenceSettings::default();
        let mut evidence = after(20, 0, 1.0);
        for _ in 0..5 {
            evidence.add_hit(0.1, 1.0, &settings);
        }
        assert!(!evidence.revokes(&settings));
    }

    #[test]
    fn scores_of_zero_and_one_are_finite() {
        assert_eq!(log_odds(0.0), -SCORE_LIMIT);
        assert_eq!(log_odds(1.0), SCORE_LIMIT);
    }
}

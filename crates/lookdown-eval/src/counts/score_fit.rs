//! The fit of scores to the persons of a data set, so that users get the right number of persons.

use super::{CALIBRATION_FLOOR, Counts, DEFAULT_COUNT_THRESHOLD, HUNDREDTHS};

/// Thresholds whose count error is at most this factor of the least one are equally good: on small
/// sets the least one is a matter of chance.
const EQUALLY_GOOD: f64 = 1.05;
/// The powers that are compared: 1.03 to the power of -60 to 60, which is 0.17 to 5.9.
const POWERS: std::ops::RangeInclusive<i32> = -60..=60;

/// A change of scores: the odds, relative to those of `even_odds`, raised to `power`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoreFit {
    /// The score that becomes 0.5, 0 to 1.
    pub even_odds: f64,
    /// The power of the odds, above 0.
    pub power: f64,
}

impl Counts {
    /// Returns the change of scores after which [`DEFAULT_COUNT_THRESHOLD`] has the least count
    /// error, and the scores from 0.05 on are the most likely probabilities of being
    /// right (Platt scaling with one free parameter). `None` if no detection is right or none is
    /// wrong.
    #[must_use]
    pub fn score_fit(&self) -> Option<ScoreFit> {
        let detections = self.images.iter().flat_map(|image| &image.detections);
        let detections: Vec<(f64, bool)> = detections
            .filter(|(score, _)| *score >= CALIBRATION_FLOOR)
            .map(|&(score, is_right)| (log_odds(score), is_right))
            .collect();
        let right = detections.iter().filter(|(_, is_right)| *is_right).count();
        if right == 0 || right == detections.len() {
            return None;
        }
        let threshold = log_odds(self.calm_threshold());
        let wanted = log_odds(DEFAULT_COUNT_THRESHOLD);
        let likelihood = |power: f64| -> f64 {
            let of_one = |&(score, is_right): &(f64, bool)| {
                let score = power * (score - threshold) + wanted;
                let sign = if is_right { 1.0 } else { -1.0 };
                // The logarithm of the logistic function.
                -(-sign * score).exp().ln_1p()
            };
            detections.iter().map(of_one).sum()
        };
        let powers = POWERS.map(|exponent| 1.03_f64.powi(exponent));
        let power = powers.max_by(|a, b| likelihood(*a).total_cmp(&likelihood(*b)))?;
        Some(ScoreFit {
            even_odds: (1.0 + (wanted / power - threshold).exp()).recip(),
            power,
        })
    }

    /// Returns the middle one of the thresholds with a small count error, in hundredths.
    fn calm_threshold(&self) -> f64 {
        let limit = EQUALLY_GOOD * self.best().count_error + f64::EPSILON;
        let thresholds = HUNDREDTHS.map(|hundredths| f64::from(hundredths) / 100.0);
        let good: Vec<f64> = thresholds
            .filter(|threshold| self.at(*threshold).count_error <= limit)
            .collect();
        good.get(good.len() / 2)
            .copied()
            .unwrap_or(DEFAULT_COUNT_THRESHOLD)
    }
}

/// Returns the logarithm of the odds of a score, which is limited to what is finite.
fn log_odds(score: f64) -> f64 {
    let score = score.clamp(1e-6, 1.0 - 1e-6);
    (score / (1.0 - score)).ln()
}

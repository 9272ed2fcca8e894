//! Calibration of scores: a reported score is the probability that a person is there.
//!
//! In fusion, the vote of a supporting view is its score × its IoU with the fused box. The merged
//! score of a clearly visible person is therefore far below 1. The odds of a person grow with a
//! power of the odds of the merged score (Platt scaling on the logit of the score).
//! `docs/lab/results.md` has the reliability of the results. The order of persons does not change.

use super::Tuning;
use crate::detection::Refinement;

/// Converts between merged scores and reported scores, both 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ScoreCalibration {
    /// Reports merged scores unchanged.
    Identity,
    /// Raises the odds, relative to those of a person as likely as not, to a power.
    Odds {
        /// The merged score of a box that is a person with probability 0.5.
        center: f64,
        /// The power.
        power: f64,
    },
}

impl ScoreCalibration {
    /// Returns the calibration for persons of a profile with this tuning.
    pub(crate) fn new(tuning: &Tuning, refinement: Refinement) -> Self {
        match refinement {
            // Suppression keeps the detector's scores.
            Refinement::Nms | Refinement::SoftNmsLinear | Refinement::SoftNmsGaussian => {
                Self::Identity
            }
            Refinement::Fusion => Self::Odds {
                center: tuning.even_odds,
                power: tuning.odds_power,
            },
        }
    }

    /// Returns the reported score of a merged score.
    pub(crate) fn reported(self, merged: f64) -> f64 {
        match self {
            Self::Identity => merged,
            Self::Odds { center, power } => from_odds((odds(merged) / odds(center)).powf(power)),
        }
    }

    /// Returns the merged score of a reported score.
    pub(crate) fn merged(self, reported: f64) -> f64 {
        match self {
            Self::Identity => reported,
            Self::Odds { center, power } => {
                from_odds(odds(reported).powf(power.recip()) * odds(center))
            }
        }
    }
}

/// Returns the odds of a probability, 0 to infinity.
fn odds(probability: f64) -> f64 {
    let probability = probability.clamp(0.0, 1.0);
    probability / (1.0 - probability)
}

/// Returns the probability of odds from 0 to infinity.
fn from_odds(odds: f64) -> f64 {
    1.0 / (1.0 + odds.recip())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::parameters::Profile;

    const QUALITY: ScoreCalibration = ScoreCalibration::Odds {
        center: 0.31,
        power: 3.0,
    };

    #[test]
    fn the_center_is_as_likely_as_not() {
        assert!((QUALITY.reported(0.31) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn the_ends_of_the_range_are_kept() {
        for end in [0.0, 1.0] {
            assert_eq!(QUALITY.reported(end), end);
            assert_eq!(QUALITY.merged(end), end);
        }
    }

    #[test]
    fn suppression_keeps_the_scores_of_the_detector() {
        let calibration =
            ScoreCalibration::new(&Profile::Fast.tuning(), Refinement::SoftNmsGaussian);
        assert_eq!(calibration.reported(0.42), 0.42);
    }

    proptest! {
        #[test]
        fn merged_inverts_reported(score in 0.01..0.99_f64) {
            let back = QUALITY.merged(QUALITY.reported(score));
            prop_assert!((back - score).abs() < 1e-9, "{back} {score}");
        }

        #[test]
        fn the_order_of_scores_is_kept(score in 0.0..0.99_f64, step in 0.001..0.01_f64) {
            prop_assert!(QUALITY.reported(score) < QUALITY.reported(score + step));
        }
    }
}

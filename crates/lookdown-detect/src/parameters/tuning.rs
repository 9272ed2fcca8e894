//! Tuning: the constants of a profile that fit it to the answers of a model.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Profile, ScoreCalibration};
use crate::detection::Refinement;

/// The constants of a profile that fit it to the answers of a model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tuning {
    /// The score merged by fusion at which a person is as likely as not, above 0 and below 1.
    /// `docs/lab/results.md` has the error of the number of persons with the profiles' own values.
    pub even_odds: f64,
    /// The power of the odds of a merged score, relative to those of `even_odds`, 0.1 to 20. One
    /// value serves all profiles with their own models, on photographs and on rendered frames.
    pub odds_power: f64,
    /// The share of a crop's side that the larger side of a person's box fills, 0.05 to 0.9.
    pub crop_fill: f64,
    /// The factor for scores from crops, in which persons lean by up to 45° and more, above 0 and at
    /// most 1. Where many upright views see a person, they give better scores, and crops give
    /// better extents.
    pub crop_vote: f64,
}

impl Tuning {
    /// Returns the tuning with which a score of `even_odds` becomes 0.5, and the odds of all scores
    /// relative to it are raised to `power`. The scores were reported with this tuning, by fusion.
    #[must_use]
    pub fn recalibrated(self, even_odds: f64, power: f64) -> Self {
        let calibration = ScoreCalibration::of(&self, Refinement::Fusion);
        Self {
            even_odds: calibration.merged(even_odds),
            odds_power: self.odds_power * power,
            ..self
        }
    }

    /// Checks the values.
    ///
    /// # Errors
    /// One sentence that names the key, its value and the range.
    pub(crate) fn check(&self) -> Result<(), String> {
        let Self {
            even_odds,
            odds_power,
            crop_fill,
            crop_vote,
        } = *self;
        for (key, value, min, max) in [
            ("even_odds", even_odds, 0.001, 0.999),
            ("odds_power", odds_power, 0.1, 20.0),
            ("crop_fill", crop_fill, 0.05, 0.9),
            ("crop_vote", crop_vote, 0.01, 1.0),
        ] {
            if !(min..=max).contains(&value) {
                return Err(format!("{key} is {value}: use {min} to {max}"));
            }
        }
        Ok(())
    }
}

/// The tunings of a model, for the profiles in which it processes all views and crops.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(transparent)]
pub struct Tunings(BTreeMap<Profile, Tuning>);

impl Tunings {
    /// Returns the tuning for a profile, or that of the profile itself.
    #[must_use]
    pub fn of(&self, profile: Profile) -> Tuning {
        let tuned = self.0.get(&profile).copied();
        tuned.unwrap_or_else(|| profile.tuning())
    }

    /// Checks the values.
    ///
    /// # Errors
    /// One sentence that names the profile, the key, its value and the range.
    pub(crate) fn check(&self) -> Result<(), String> {
        self.0.iter().try_for_each(|(profile, tuning)| {
            let checked = tuning.check();
            checked.map_err(|problem| format!("tuning.{profile}.{problem}"))
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn reported(tuning: &Tuning, merged: f64) -> f64 {
        ScoreCalibration::of(tuning, Refinement::Fusion).reported(merged)
    }

    fn odds(score: f64) -> f64 {
        score / (1.0 - score)
    }

    proptest! {
        #[test]
        fn recalibration_is_a_line_in_the_logarithm_of_the_odds(
            merged in 0.05..0.95_f64,
            even_odds in 0.1..0.9_f64,
            power in 0.5..2.0_f64,
        ) {
            let before = Profile::Fast.tuning();
            let after = before.recalibrated(even_odds, power);
            let line = power * (odds(reported(&before, merged)) / odds(even_odds)).ln();
            let got = odds(reported(&after, merged)).ln();
            prop_assert!((got - line).abs() < 1e-6, "{got} {line}");
        }
    }

    #[test]
    fn the_profiles_have_values_within_the_ranges() {
        use strum::VariantArray;
        for profile in Profile::VARIANTS {
            assert_eq!(profile.tuning().check(), Ok(()));
        }
    }

    #[test]
    fn a_value_beyond_its_range_is_named() {
        let tuning = Tuning {
            crop_fill: 2.0,
            ..Profile::Fast.tuning()
        };
        let tunings = Tunings(BTreeMap::from([(Profile::Fast, tuning)]));
        let problem = "tuning.fast.crop_fill is 2: use 0.05 to 0.9".to_owned();
        assert_eq!(tunings.check(), Err(problem));
    }

    #[test]
    fn a_profile_without_a_tuning_keeps_its_own() {
        assert_eq!(
            Tunings::default().of(Profile::Quality),
            Profile::Quality.tuning()
        );
    }
}

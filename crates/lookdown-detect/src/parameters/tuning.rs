//! Tuning: the constants of a profile that fit it to the answers of a model.

use serde::{Deserialize, Serialize};

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
    /// The factor for scores from crops, in which persons lean by up to 45° and more, above 0 and
    /// at most 1. Where many upright views see a person, they give better scores, and crops give
    /// better extents.
    pub crop_vote: f64,
}

impl Tuning {
    /// Checks the values.
    ///
    /// # Errors
    /// One sentence that names the key, its value and the range.
    pub(crate) fn check(&self) -> Result<(), String> {
        let mut values = *self;
        for (key, value, min, max) in values.ranges() {
            if !(min..=max).contains(value) {
                return Err(format!("{key} is {value}: use {min} to {max}"));
            }
        }
        Ok(())
    }

    /// Returns the nearest values that a manifest may have.
    #[must_use]
    pub fn clamped(mut self) -> Self {
        for (_, value, min, max) in self.ranges() {
            *value = value.clamp(min, max);
        }
        self
    }

    /// The values with their keys, least and greatest values.
    fn ranges(&mut self) -> [(&'static str, &mut f64, f64, f64); 4] {
        let Self {
            even_odds,
            odds_power,
            crop_fill,
            crop_vote,
        } = self;
        [
            ("even_odds", even_odds, 0.001, 0.999),
            ("odds_power", odds_power, 0.1, 20.0),
            ("crop_fill", crop_fill, 0.05, 0.9),
            ("crop_vote", crop_vote, 0.01, 1.0),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::Tuning;

    #[test]
    fn clamped_values_are_valid() {
        for value in [-1.0, 0.0, 0.5, 1.0, 100.0] {
            let tuning = Tuning {
                even_odds: value,
                odds_power: value,
                crop_fill: value,
                crop_vote: value,
            };
            assert_eq!(tuning.check().is_ok(), value == 0.5);
            assert_eq!(tuning.clamped().check(), Ok(()));
            assert_eq!(tuning.clamped() == tuning, value == 0.5);
        }
    }
}

//! The tunings of a model, by profile.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::{Profile, Tuning};

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
    use strum::VariantArray;

    use super::*;

    #[test]
    fn the_profiles_have_values_within_the_ranges() {
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

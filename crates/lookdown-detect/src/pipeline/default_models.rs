//! The default models: one for each profile and device, for requests that name no model.

use std::iter;

use strum::VariantArray;

use crate::{
    inference::Int8Use,
    parameters::{DetectParameters, Profile},
};

/// Returns the models of a profile, in order of preference. This is the only table of them. Models
/// that were not fetched are skipped; [`FALLBACK`] is the last choice.
fn preferred(profile: Profile, int8: Int8Use) -> &'static [&'static str] {
    match (profile, int8) {
        (Profile::Paper | Profile::Direct, Int8Use::None) => &[FALLBACK],
        (Profile::Paper | Profile::Direct, _) => &[SSDLITE_INT8],
        (Profile::Fast, Int8Use::SmallProfiles)
        | (Profile::Fast | Profile::Balanced | Profile::Quality, Int8Use::All) => {
            &[VIEWS_INT8, VIEWS]
        }
        (Profile::Fast | Profile::Balanced | Profile::Quality, _) => &[VIEWS],
    }
}

/// Returns the models of a profile's upright crops, in order of preference. They are trained on
/// rendered fisheye frames; the profile's own model is the last choice. Packages include the model
/// in INT8 only.
fn preferred_for_crops(profile: Profile, int8: Int8Use) -> &'static [&'static str] {
    match (profile, int8) {
        (Profile::Paper | Profile::Direct, _) => &[],
        (_, Int8Use::None) => &[FISHEYE],
        (_, Int8Use::SmallProfiles | Int8Use::All) => &[FISHEYE_INT8],
    }
}

const VIEWS: &str = "nanodet_g_views_416";

const VIEWS_INT8: &str = "nanodet_g_views_416_int8";

const FISHEYE: &str = "nanodet_g_fisheye_416";

const FISHEYE_INT8: &str = "nanodet_g_fisheye_416_int8";

const SSDLITE_INT8: &str = "ssdlite_mobilenet_v2_int8";

/// The fallback for models that were not fetched: every installation includes it.
const FALLBACK: &str = "ssdlite_mobilenet_v2";

/// The default models of the profiles.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DefaultModels {
    /// One model for all profiles.
    One(String),
    /// One model for each profile, or the fallback that every installation includes.
    PerProfile {
        /// The models in INT8.
        int8: Int8Use,
        /// The preferred models that were not fetched.
        missing: Vec<&'static str>,
    },
}

impl DefaultModels {
    /// Selects the model of each profile from those that `is_fetched` accepts.
    #[must_use]
    pub fn per_profile(int8: Int8Use, is_fetched: impl Fn(&str) -> bool) -> Self {
        let mut missing: Vec<_> = Profile::VARIANTS
            .iter()
            .flat_map(|&profile| {
                let crops = preferred_for_crops(profile, int8);
                preferred(profile, int8).iter().chain(crops)
            })
            .copied()
            .filter(|name| *name != FALLBACK && !is_fetched(name))
            .collect();
        missing.sort_unstable();
        missing.dedup();
        Self::PerProfile { int8, missing }
    }

    /// Returns the models in INT8; `None` for one model for all profiles.
    #[must_use]
    pub fn int8(&self) -> Option<Int8Use> {
        match self {
            Self::One(_) => None,
            Self::PerProfile { int8, .. } => Some(*int8),
        }
    }

    /// Returns the model of a profile.
    #[must_use]
    pub fn of(&self, profile: Profile) -> &str {
        match self {
            Self::One(name) => name,
            Self::PerProfile { int8, missing } => {
                let mut models = preferred(profile, *int8).iter();
                let fetched = models.find(|name| !missing.contains(name));
                fetched.copied().unwrap_or(FALLBACK)
            }
        }
    }

    /// Returns the model of a profile's upright crops, if it differs from the profile's own model.
    #[must_use]
    pub fn crop_model(&self, profile: Profile) -> Option<&str> {
        let Self::PerProfile { int8, missing } = self else {
            return None;
        };
        let mut models = preferred_for_crops(profile, *int8).iter();
        models.find(|name| !missing.contains(name)).copied()
    }

    /// Returns the models that a request needs.
    #[must_use]
    pub fn needed_by<'a>(&'a self, request: &'a DetectParameters) -> Vec<&'a str> {
        match &request.model {
            Some(name) => vec![name],
            None => self.of_profile(request.profile).collect(),
        }
    }

    /// Returns each model once. The model of the default profile comes first.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        let default = iter::once(Profile::default());
        let profiles = default.chain(Profile::VARIANTS.iter().copied());
        let mut names = Vec::new();
        for name in profiles.flat_map(|profile| self.of_profile(profile)) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// Returns the profile's own model and that of its crops.
    fn of_profile(&self, profile: Profile) -> impl Iterator<Item = &str> {
        iter::once(self.of(profile)).chain(self.crop_model(profile))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_that_was_not_fetched_has_a_fallback() {
        let all = DefaultModels::per_profile(Int8Use::SmallProfiles, |_| true);
        assert_eq!(all.names(), [VIEWS, FISHEYE_INT8, SSDLITE_INT8, VIEWS_INT8]);
        let without = DefaultModels::per_profile(Int8Use::SmallProfiles, |name| name != VIEWS_INT8);
        assert_eq!(without.of(Profile::Fast), VIEWS);
        let few = DefaultModels::per_profile(Int8Use::SmallProfiles, |_| false);
        assert_eq!(few.names(), [FALLBACK]);
    }

    #[test]
    fn int8_models_are_selected_by_profile_and_cpu() {
        let gpu = DefaultModels::per_profile(Int8Use::None, |_| true);
        assert_eq!(gpu.of(Profile::Paper), FALLBACK);
        let cpu = DefaultModels::per_profile(Int8Use::SmallProfiles, |_| true);
        assert_eq!(cpu.of(Profile::Paper), SSDLITE_INT8);
        assert_eq!(
            (cpu.of(Profile::Fast), gpu.of(Profile::Fast)),
            (VIEWS_INT8, VIEWS)
        );
        assert_eq!(cpu.of(Profile::Balanced), gpu.of(Profile::Balanced));
        let vnni = DefaultModels::per_profile(Int8Use::All, |_| true);
        assert_eq!(vnni.of(Profile::Balanced), VIEWS_INT8);
        assert_eq!(vnni.of(Profile::Quality), VIEWS_INT8);
        assert_eq!(vnni.crop_model(Profile::Balanced), Some(FISHEYE_INT8));
        let not_fetched = DefaultModels::per_profile(Int8Use::All, |name| name != VIEWS_INT8);
        assert_eq!(not_fetched.of(Profile::Balanced), VIEWS);
    }

    #[test]
    fn crops_have_a_model_of_their_own_if_it_was_fetched() {
        let all = DefaultModels::per_profile(Int8Use::SmallProfiles, |_| true);
        let crop_models = [
            Profile::Fast,
            Profile::Balanced,
            Profile::Quality,
            Profile::Paper,
        ]
        .map(|profile| all.crop_model(profile));
        assert_eq!(
            crop_models,
            [
                Some(FISHEYE_INT8),
                Some(FISHEYE_INT8),
                Some(FISHEYE_INT8),
                None
            ]
        );
        let without =
            DefaultModels::per_profile(Int8Use::SmallProfiles, |name| name != FISHEYE_INT8);
        assert_eq!(without.crop_model(Profile::Fast), None);
        let gpu = DefaultModels::per_profile(Int8Use::None, |_| true);
        assert_eq!(gpu.crop_model(Profile::Fast), Some(FISHEYE));
        let one = DefaultModels::One("mine".to_owned());
        assert_eq!(one.crop_model(Profile::Balanced), None);
    }

    #[test]
    fn one_model_can_serve_all_profiles() {
        let one = DefaultModels::One("mine".to_owned());
        assert!(
            Profile::VARIANTS
                .iter()
                .all(|profile| one.of(*profile) == "mine")
        );
        assert_eq!(one.names(), ["mine"]);
    }
}

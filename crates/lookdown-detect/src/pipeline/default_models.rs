//! The default models: one for each profile and device, for requests that name no model.

use std::iter;

use strum::VariantArray;

use crate::{
    inference::Device,
    parameters::{DetectParameters, Profile},
};

/// Returns the models of a profile, in order of preference. This is the only table of them. Models
/// that were not fetched are skipped; [`FALLBACK`] is the last choice.
fn preferred(profile: Profile, device: Device) -> &'static [&'static str] {
    match (profile, device) {
        (Profile::Paper | Profile::Direct, Device::Cpu) => &[SSDLITE_INT8],
        (Profile::Paper | Profile::Direct, _) => &[FALLBACK],
        (Profile::Fast, Device::Cpu) => &[NANODET_INT8, NANODET],
        (Profile::Fast | Profile::Balanced | Profile::Quality, _) => &[NANODET],
    }
}

/// Returns the models of a profile's upright crops, in order of preference. They are trained on
/// rendered fisheye frames; the profile's own model is the last choice. Packages include the model
/// in INT8 only.
fn preferred_for_crops(profile: Profile, device: Device) -> &'static [&'static str] {
    match (profile, device) {
        (Profile::Paper | Profile::Direct, _) => &[],
        (_, Device::Cpu) => &[FISHEYE_INT8],
        (Profile::Fast | Profile::Balanced | Profile::Quality, _) => &[FISHEYE],
    }
}

/// Returns the profile whose model processes half of the zoom views of `profile`.
fn second_model_profile(profile: Profile) -> Option<Profile> {
    (profile == Profile::Quality).then_some(Profile::Paper)
}

const NANODET: &str = "nanodet_g_416";

/// ONNX Runtime has integer kernels for this model on CPUs only.
const NANODET_INT8: &str = "nanodet_g_416_int8";

const FISHEYE: &str = "nanodet_g_fisheye_416";

/// ONNX Runtime has integer kernels for this model on CPUs only.
const FISHEYE_INT8: &str = "nanodet_g_fisheye_416_int8";

/// ONNX Runtime has integer kernels for this model on CPUs only.
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
        /// The device that runs the models.
        device: Device,
        /// The preferred models that were not fetched.
        missing: Vec<&'static str>,
    },
}

impl DefaultModels {
    /// Selects the model of each profile for this device from those that `is_fetched` accepts.
    #[must_use]
    pub fn per_profile(device: Device, is_fetched: impl Fn(&str) -> bool) -> Self {
        let mut missing: Vec<_> = Profile::VARIANTS
            .iter()
            .flat_map(|&profile| {
                let crops = preferred_for_crops(profile, device);
                preferred(profile, device).iter().chain(crops)
            })
            .copied()
            .filter(|name| *name != FALLBACK && !is_fetched(name))
            .collect();
        missing.sort_unstable();
        missing.dedup();
        Self::PerProfile { device, missing }
    }

    /// Returns the model of a profile.
    #[must_use]
    pub fn of(&self, profile: Profile) -> &str {
        match self {
            Self::One(name) => name,
            Self::PerProfile { device, missing } => {
                let mut models = preferred(profile, *device).iter();
                let fetched = models.find(|name| !missing.contains(name));
                fetched.copied().unwrap_or(FALLBACK)
            }
        }
    }

    /// Returns the second model of a profile's zoom views, if the profile has one and it differs
    /// from the profile's own model.
    #[must_use]
    pub fn second_opinion(&self, profile: Profile) -> Option<&str> {
        let name = self.of(second_model_profile(profile)?);
        (name != self.of(profile)).then_some(name)
    }

    /// Returns the model of a profile's upright crops, if it differs from the profile's own model.
    #[must_use]
    pub fn crop_model(&self, profile: Profile) -> Option<&str> {
        let Self::PerProfile { device, missing } = self else {
            return None;
        };
        let mut models = preferred_for_crops(profile, *device).iter();
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

    /// Returns the profile's own model, that of half of its zoom views, and that of its crops.
    fn of_profile(&self, profile: Profile) -> impl Iterator<Item = &str> {
        iter::once(self.of(profile))
            .chain(self.second_opinion(profile))
            .chain(self.crop_model(profile))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_that_was_not_fetched_has_a_fallback() {
        let all = DefaultModels::per_profile(Device::Cpu, |_| true);
        assert_eq!(
            all.names(),
            [NANODET, FISHEYE_INT8, SSDLITE_INT8, NANODET_INT8]
        );
        let without = DefaultModels::per_profile(Device::Cpu, |name| name != NANODET_INT8);
        assert_eq!(without.of(Profile::Fast), NANODET);
        let few = DefaultModels::per_profile(Device::Cpu, |_| false);
        assert_eq!(few.names(), [FALLBACK]);
    }

    #[test]
    fn int8_models_are_selected_on_cpus_only() {
        let gpu = DefaultModels::per_profile(Device::Cuda(0), |_| true);
        assert_eq!(gpu.of(Profile::Paper), FALLBACK);
        let cpu = DefaultModels::per_profile(Device::Cpu, |_| true);
        assert_eq!(cpu.of(Profile::Paper), SSDLITE_INT8);
        assert_eq!(
            (cpu.of(Profile::Fast), gpu.of(Profile::Fast)),
            (NANODET_INT8, NANODET)
        );
        assert_eq!(cpu.of(Profile::Quality), gpu.of(Profile::Quality));
    }

    #[test]
    fn second_model_differs_from_the_profile_s_own_model() {
        let all = DefaultModels::per_profile(Device::Cpu, |_| true);
        assert_eq!(all.second_opinion(Profile::Quality), Some(SSDLITE_INT8));
        assert_eq!(all.second_opinion(Profile::Balanced), None);
        let few = DefaultModels::per_profile(Device::Cpu, |_| false);
        assert_eq!(few.second_opinion(Profile::Quality), None);
        let one = DefaultModels::One("mine".to_owned());
        assert_eq!(one.second_opinion(Profile::Quality), None);
    }

    #[test]
    fn crops_have_a_model_of_their_own_if_it_was_fetched() {
        let all = DefaultModels::per_profile(Device::Cpu, |_| true);
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
        let without = DefaultModels::per_profile(Device::Cpu, |name| name != FISHEYE_INT8);
        assert_eq!(without.crop_model(Profile::Fast), None);
        let gpu = DefaultModels::per_profile(Device::Cuda(0), |_| true);
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

//! Which model answers requests that name none.

use strum::VariantArray;

use super::Profile;
use crate::inference::Device;

/// The models of a profile, the preferred one first: the one table of them. Those that were not
/// fetched are passed over; [`STAND_IN`] comes after all.
fn preferred(profile: Profile, device: Device) -> &'static [&'static str] {
    match (profile, device) {
        (Profile::Paper | Profile::Direct, Device::Cpu) => &[SSDLITE_INT8],
        (Profile::Paper | Profile::Direct, _) => &[STAND_IN],
        (Profile::Fast, Device::Cpu) => &[NANODET_INT8, NANODET],
        (Profile::Fast | Profile::Balanced | Profile::Quality, _) => &[NANODET],
    }
}

/// Whose model takes half of a profile's closer passes.
fn second_opinion_of(profile: Profile) -> Option<Profile> {
    (profile == Profile::Quality).then_some(Profile::Paper)
}

const NANODET: &str = "nanodet_g_416";

/// ONNX Runtime has integer kernels for it on processors alone.
const NANODET_INT8: &str = "nanodet_g_416_int8";

/// ONNX Runtime has integer kernels for it on processors alone.
const SSDLITE_INT8: &str = "ssdlite_mobilenet_v2_int8";

/// Stands in for models that were not fetched: the smallest set-up has this one.
const STAND_IN: &str = "ssdlite_mobilenet_v2";

/// Which model answers requests of a profile that name none.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DefaultModels {
    /// One for all profiles.
    One(String),
    /// Each profile's own, or another one that every set-up has.
    PerProfile {
        /// What networks run on.
        device: Device,
        /// The profiles' models that are missing.
        missing: Vec<&'static str>,
    },
}

impl DefaultModels {
    /// Each profile's own model for this device, as far as `is_fetched` says that it is there.
    #[must_use]
    pub fn per_profile(device: Device, is_fetched: impl Fn(&str) -> bool) -> Self {
        let mut missing: Vec<_> = Profile::VARIANTS
            .iter()
            .flat_map(|&profile| preferred(profile, device))
            .copied()
            .filter(|name| *name != STAND_IN && !is_fetched(name))
            .collect();
        missing.sort_unstable();
        missing.dedup();
        Self::PerProfile { device, missing }
    }

    /// The model of a profile.
    #[must_use]
    pub fn of(&self, profile: Profile) -> &str {
        match self {
            Self::One(name) => name,
            Self::PerProfile { device, missing } => {
                let mut models = preferred(profile, *device).iter();
                let fetched = models.find(|name| !missing.contains(name));
                fetched.copied().unwrap_or(STAND_IN)
            }
        }
    }

    /// The model that gives a second opinion in a profile's closer passes, if that profile has one
    /// and it is another than its own.
    #[must_use]
    pub fn second_model(&self, profile: Profile) -> Option<&str> {
        let name = self.of(second_opinion_of(profile)?);
        (name != self.of(profile)).then_some(name)
    }

    /// All of them, each once; that of the default profile comes first.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        let mut names = vec![self.of(Profile::default())];
        for &profile in Profile::VARIANTS {
            let name = self.of(profile);
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_that_was_not_fetched_has_a_stand_in() {
        let all = DefaultModels::per_profile(Device::Cpu, |_| true);
        assert_eq!(all.names(), [NANODET, SSDLITE_INT8, NANODET_INT8]);
        let without = DefaultModels::per_profile(Device::Cpu, |name| name != NANODET_INT8);
        assert_eq!(without.of(Profile::Fast), NANODET);
        let few = DefaultModels::per_profile(Device::Cpu, |_| false);
        assert_eq!(few.names(), [STAND_IN]);
    }

    #[test]
    fn only_a_processor_gets_the_int8_form() {
        let gpu = DefaultModels::per_profile(Device::Cuda(0), |_| true);
        assert_eq!(gpu.of(Profile::Paper), STAND_IN);
        let cpu = DefaultModels::per_profile(Device::Cpu, |_| true);
        assert_eq!(cpu.of(Profile::Paper), SSDLITE_INT8);
        assert_eq!(
            (cpu.of(Profile::Fast), gpu.of(Profile::Fast)),
            (NANODET_INT8, NANODET)
        );
        assert_eq!(cpu.of(Profile::Quality), gpu.of(Profile::Quality));
    }

    #[test]
    fn a_second_opinion_is_another_model_s() {
        let all = DefaultModels::per_profile(Device::Cpu, |_| true);
        assert_eq!(all.second_model(Profile::Quality), Some(SSDLITE_INT8));
        assert_eq!(all.second_model(Profile::Balanced), None);
        let few = DefaultModels::per_profile(Device::Cpu, |_| false);
        assert_eq!(few.second_model(Profile::Quality), None);
        let one = DefaultModels::One("mine".to_owned());
        assert_eq!(one.second_model(Profile::Quality), None);
    }

    #[test]
    fn one_model_can_answer_for_all_profiles() {
        let one = DefaultModels::One("mine".to_owned());
        assert!(
            Profile::VARIANTS
                .iter()
                .all(|profile| one.of(*profile) == "mine")
        );
        assert_eq!(one.names(), ["mine"]);
    }
}

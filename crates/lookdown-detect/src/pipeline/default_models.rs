//! The default models, for requests that name no model.

use std::iter;

use crate::{
    inference::Device,
    parameters::{DetectParameters, Profile},
};

/// The default models of the profiles.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DefaultModels {
    model: String,
    crop_model: Option<String>,
    floor_model: String,
}

impl DefaultModels {
    /// Returns our own networks in the form for a device: INT8 for the integer kernels of ONNX
    /// Runtime, which the CPU alone has, and weights in half precision for other devices.
    pub fn for_device(device: Device) -> Self {
        let ending = if device == Device::Cpu { "" } else { "_fp16" };
        Self {
            model: format!("nanodet_g_views_416{ending}"),
            crop_model: Some(format!("nanodet_g_fisheye_416{ending}")),
            floor_model: format!("nanodet_g_floor_416{ending}"),
        }
    }

    /// Uses one model for the views and the crops of all profiles, also for people on the floor.
    pub fn one(model: String) -> Self {
        Self {
            floor_model: model.clone(),
            model,
            crop_model: None,
        }
    }

    /// Returns the model of the views of all profiles.
    pub fn model(&self) -> &str {
        &self.model
    }

    /// Returns the model of a profile's upright crops, if it differs from that of its views.
    pub fn crop_model(&self, profile: Profile) -> Option<&str> {
        match profile {
            Profile::Paper | Profile::Direct => None,
            Profile::Fast | Profile::Balanced | Profile::Quality => self.crop_model.as_deref(),
        }
    }

    /// Returns the model of the views that also finds people on the floor.
    pub fn floor_model(&self) -> &str {
        &self.floor_model
    }

    /// Returns the model of the views of a request that names none.
    pub fn model_of(&self, request: &DetectParameters) -> &str {
        if request.floor {
            &self.floor_model
        } else {
            &self.model
        }
    }

    /// Returns the models that a request needs.
    pub fn needed_by<'a>(&'a self, request: &'a DetectParameters) -> Vec<&'a str> {
        match &request.model {
            Some(name) => vec![name],
            None => iter::once(self.model_of(request))
                .chain(self.crop_model(request.profile))
                .collect(),
        }
    }

    /// Returns all models, that of the views first.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        iter::once(self.model()).chain(self.crop_model.as_deref())
    }
}

#[cfg(test)]
mod tests {
    use strum::VariantArray;

    use super::*;

    #[test]
    fn the_device_selects_int8_or_half_precision() {
        let names = |device: &str| {
            let models = DefaultModels::for_device(device.parse().unwrap());
            models.names().map(ToOwned::to_owned).collect::<Vec<_>>()
        };
        assert_eq!(
            names("cpu"),
            ["nanodet_g_views_416", "nanodet_g_fisheye_416"]
        );
        for device in ["cuda:0", "tensorrt:1", "openvino:cpu", "openvino:gpu"] {
            assert_eq!(
                names(device),
                ["nanodet_g_views_416_fp16", "nanodet_g_fisheye_416_fp16"]
            );
        }
    }

    #[test]
    fn only_profiles_with_upright_crops_need_their_model() {
        let models = DefaultModels::for_device(Device::Cpu);
        let with_crops = |profile: &&Profile| models.crop_model(**profile).is_some();
        let profiles: Vec<_> = Profile::VARIANTS.iter().filter(with_crops).collect();
        assert_eq!(
            profiles,
            [&Profile::Fast, &Profile::Balanced, &Profile::Quality]
        );
    }

    #[test]
    fn one_model_can_serve_all_profiles() {
        let one = DefaultModels::one("mine".to_owned());
        assert_eq!(one.names().collect::<Vec<_>>(), ["mine"]);
        assert_eq!(one.crop_model(Profile::Balanced), None);
        let floor = DetectParameters::parse([(DetectParameters::FLOOR, "true")]).unwrap();
        assert_eq!(one.needed_by(&floor), ["mine"]);
    }
}

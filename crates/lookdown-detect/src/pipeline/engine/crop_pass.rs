//! The last pass of a search: upright crops around possible persons, and one below the camera.

use std::{sync::Arc, time::Instant};

use lookdown_lens::geometry::crop_placement::{CropTarget, nadir_crop, place_crops};

use super::{Engine, Observation};
use crate::{
    inference::Model,
    parameters::DetectParameters,
    pipeline::{DetectJob, Stage, camera_rig::CameraRig, network::PassTask},
};

impl Engine {
    /// Queues upright crops of the frame around the targets and at the nadir.
    pub(super) fn crop_pass(
        &self,
        job: &DetectJob,
        observation: &Observation,
        targets: &[CropTarget],
    ) -> Option<Arc<PassTask>> {
        let timeline = &job.ticket.timeline;
        timeline.enter(Stage::Remap, Instant::now());
        let Some((rig, model)) = self.crops(job, observation, targets) else {
            timeline.leave(Instant::now());
            return None;
        };
        let rig = Arc::new(rig);
        let camera = job.parameters.motion_camera();
        let cached = camera.and_then(|camera| self.motion_cache.crop_views(camera, &rig, &model));
        Some(self.queue_later(job, observation, rig, model, cached))
    }

    /// Plans upright crops for the profile's model of crops, or for the model that the request
    /// names.
    fn crops(
        &self,
        job: &DetectJob,
        observation: &Observation,
        targets: &[CropTarget],
    ) -> Option<(CameraRig, Arc<Model>)> {
        let model = self.crop_model(&job.parameters, &observation.model);
        let side = model.input().width.min(model.input().height);
        let max_crops = observation.profile.max_crops();
        let mut crops = place_crops(targets, max_crops, observation.tuning.crop_fill, side);
        if observation.profile.has_nadir_crop() {
            let geometry = observation.camera.rig.geometry();
            crops.extend(nadir_crop(&geometry.lens, &geometry.mount, side));
        }
        if observation.profile.mirrors_crops() {
            crops = crops
                .iter()
                .flat_map(|crop| [*crop, crop.mirrored()])
                .collect();
        }
        let (width, height) = (observation.frame.width(), observation.frame.height());
        let rig = &observation.camera.rig;
        let rig = self
            .remappers
            .install(|| rig.with_crops(side, &crops, width, height));
        (rig.view_count() > 0).then_some((rig, model))
    }

    /// Returns the model of the upright crops of a request whose views `model` processes: the
    /// profile's, or `model` if the request names it or the profile has none.
    pub(super) fn crop_model(
        &self,
        parameters: &DetectParameters,
        model: &Arc<Model>,
    ) -> Arc<Model> {
        let models = &self.options.default_models;
        let unnamed = parameters.model.is_none();
        let own = unnamed.then(|| models.crop_model(parameters.profile));
        let own = own.flatten().and_then(|name| self.models.get(name));
        own.unwrap_or_else(|| Arc::clone(model))
    }
}

//! The further looks of a search: detail views and crops where persons are possible.

use std::{sync::Arc, time::Instant};

use lookdown_lens::geometry::crop_placement::{CropTarget, nadir_crop, place_crops};

use super::{Engine, Observation};
use crate::{
    inference::Model,
    parameters::DetectParameters,
    pipeline::{
        DetectJob, PipelineError, Stage, camera_rig::CameraRig, merge, motion_cache::CameraViews,
        network::PassTask,
    },
};

impl Engine {
    /// Looks again where the first pass shows a possible person, if the profile does so.
    pub(super) fn look_again(
        &self,
        job: &DetectJob,
        observation: &mut Observation,
    ) -> Result<(), PipelineError> {
        if !observation.profile.has_crops() {
            return Ok(());
        }
        let targets = observation.possible_persons(true);
        if let Some(details) = self.detail_pass(job, observation, &targets) {
            observation.wait_for(&details)?;
        }
        // The network of crops does not know people on the floor.
        let targets = observation.possible_persons(false);
        if let Some(crops) = self.crop_pass(job, observation, &targets) {
            observation.wait_for(&crops)?;
        }
        Ok(())
    }

    /// Queues a pass over a frame. Views without motion according to `cached_views` skip the
    /// network.
    pub(super) fn queue_pass(
        &self,
        job: &DetectJob,
        observation: &Observation,
        rig: Arc<CameraRig>,
        model: Arc<Model>,
        cached_views: Option<Arc<CameraViews>>,
    ) -> Arc<PassTask> {
        job.ticket.timeline.enter(Stage::Queue, Instant::now());
        let frame = Arc::clone(&observation.network_frame);
        let ticket = job.ticket.clone();
        self.inference
            .queue_pass(rig, model, frame, ticket, cached_views)
    }

    /// Queues upright crops of the frame around the targets and at the nadir.
    fn crop_pass(
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
        Some(self.queue_pass(job, observation, rig, model, cached))
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
        let side = model.input.width.min(model.input.height);
        let max_crops = observation.profile.max_crops();
        let mut crops = place_crops(targets, max_crops, observation.tuning.crop_fill, side);
        if observation.profile.has_nadir_crop() {
            let geometry = &observation.camera.rig.geometry;
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

    /// Queues the detail views of the plan that show the middle of a target.
    fn detail_pass(
        &self,
        job: &DetectJob,
        observation: &Observation,
        targets: &[CropTarget],
    ) -> Option<Arc<PassTask>> {
        let rig = Arc::new(observation.camera.rig.with_details_of(targets)?);
        let model = Arc::clone(&observation.model);
        let camera = job.parameters.motion_camera();
        let cached = camera.and_then(|camera| self.motion_cache.detail_views(camera, &rig, &model));
        Some(self.queue_pass(job, observation, rig, model, cached))
    }
}

impl Observation {
    /// Returns the possible persons in the passes so far, highest score first; `with_postures` with
    /// those on the floor.
    fn possible_persons(&self, with_postures: bool) -> Vec<CropTarget> {
        self.timeline.enter(Stage::Refine, Instant::now());
        let (passes, rig) = (&self.passes, &self.camera.rig);
        merge::possible_persons(passes, rig, self.profile, &self.tuning, with_postures)
    }
}

//! The further looks of a search: detail views and crops where persons are possible.

use std::{sync::Arc, time::Instant};

use lookdown_lens::geometry::{
    FrameCrop,
    crop_placement::{CropTarget, nadir_crop, place_crops},
};

use super::{Engine, Observation};
use crate::{
    inference::Model,
    parameters::DetectParameters,
    pipeline::{
        DetectJob, PipelineError, Stage, camera_rig::CameraRig, merge, motion_cache::CameraViews,
        network::PassTask,
    },
};

/// Most crops around people on the floor. With 2 or 3 instead of 5, `fast` finds .76 or .77 instead
/// of .81 of those who lie in 120 rendered frames of 18 people.
const MAX_FLOOR_CROPS: usize = 5;

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
        let mut targets = observation.possible_persons(false);
        let seen = observation.passes.len();
        if let Some(details) = self.detail_pass(job, observation, &targets) {
            observation.wait_for(&details)?;
        }
        // The network of the other crops does not know people on the floor.
        let model = Arc::clone(&observation.model);
        if model.tells_postures {
            let targets = observation.possible_persons(true);
            let fill = observation.tuning.crop_fill;
            let crops = place_crops(&targets, MAX_FLOOR_CROPS, fill, model.input.shorter_side());
            if let Some(crops) = self.crop_pass(job, observation, model, &crops) {
                observation.wait_for(&crops)?;
            }
        }
        if observation.passes.len() > seen {
            targets = observation.possible_persons(false);
        }
        let model = self.crop_model(&job.parameters, &observation.model);
        let crops = observation.crops(&targets, model.input.shorter_side());
        if let Some(crops) = self.crop_pass(job, observation, model, &crops) {
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

    /// Queues crops of the frame.
    fn crop_pass(
        &self,
        job: &DetectJob,
        observation: &Observation,
        model: Arc<Model>,
        crops: &[FrameCrop],
    ) -> Option<Arc<PassTask>> {
        let timeline = &job.ticket.timeline;
        timeline.enter(Stage::Remap, Instant::now());
        let (width, height) = (observation.frame.width(), observation.frame.height());
        let (rig, side) = (&observation.camera.rig, model.input.shorter_side());
        let rig = self
            .remappers
            .install(|| rig.with_crops(side, crops, width, height));
        if rig.view_count() == 0 {
            timeline.leave(Instant::now());
            return None;
        }
        let rig = Arc::new(rig);
        let camera = job.parameters.motion_camera();
        let cached = camera.and_then(|camera| self.motion_cache.crop_views(camera, &rig, &model));
        Some(self.queue_pass(job, observation, rig, model, cached))
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
    /// Returns the possible persons in the passes so far, highest score first: those that any
    /// network knows, or those `on_the_floor`.
    fn possible_persons(&self, on_the_floor: bool) -> Vec<CropTarget> {
        self.timeline.enter(Stage::Refine, Instant::now());
        let (passes, rig) = (&self.passes, &self.camera.rig);
        merge::possible_persons(passes, rig, self.profile, &self.tuning, on_the_floor)
    }

    /// Places upright crops around the targets and at the nadir, as the profile has them.
    fn crops(&self, targets: &[CropTarget], side: u32) -> Vec<FrameCrop> {
        let max_crops = self.profile.max_crops();
        let mut crops = place_crops(targets, max_crops, self.tuning.crop_fill, side);
        if self.profile.has_nadir_crop() {
            let geometry = &self.camera.rig.geometry;
            crops.extend(nadir_crop(&geometry.lens, &geometry.mount, side));
        }
        if self.profile.mirrors_crops() {
            crops = crops
                .iter()
                .flat_map(|crop| [*crop, crop.mirrored()])
                .collect();
        }
        crops
    }
}

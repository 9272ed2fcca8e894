//! The further looks of a search: detail views and crops where persons are possible.

use std::{sync::Arc, time::Instant};

use lookdown_lens::geometry::crop_placement::CropTarget;

use super::{Engine, Observation};
use crate::{
    inference::Model,
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
        let mut targets = observation.possible_persons();
        if let Some(details) = self.detail_pass(job, observation, &targets) {
            observation.wait_for(&details)?;
            targets = observation.possible_persons();
        }
        if let Some(crops) = self.crop_pass(job, observation, &targets) {
            observation.wait_for(&crops)?;
        }
        Ok(())
    }

    /// Queues a later pass over a frame.
    pub(super) fn queue_later(
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
}

impl Observation {
    /// Returns the possible persons in the passes so far, highest score first.
    fn possible_persons(&self) -> Vec<CropTarget> {
        self.timeline.enter(Stage::Refine, Instant::now());
        let (passes, rig) = (&self.passes, &self.camera.rig);
        merge::possible_persons(passes, rig, self.profile, &self.tuning)
    }
}

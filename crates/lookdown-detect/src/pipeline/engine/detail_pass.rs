//! The second pass of a search: the detail views that show a possible person.

use std::sync::Arc;

use lookdown_lens::geometry::crop_placement::CropTarget;

use super::{Engine, Observation};
use crate::pipeline::{DetectJob, network::PassTask};

impl Engine {
    /// Queues the detail views of the plan that show the middle of a target.
    pub(super) fn detail_pass(
        &self,
        job: &DetectJob,
        observation: &Observation,
        targets: &[CropTarget],
    ) -> Option<Arc<PassTask>> {
        let rig = Arc::new(observation.camera.rig.with_details_of(targets)?);
        let model = Arc::clone(&observation.model);
        let camera = job.parameters.motion_camera();
        let cached = camera.and_then(|camera| self.motion_cache.detail_views(camera, &rig, &model));
        Some(self.queue_later(job, observation, rig, model, cached))
    }
}

//! The second pass of a search: the detail views that show a possible person.

use std::{sync::Arc, time::Instant};

use lookdown_lens::geometry::crop_placement::CropTarget;

use super::{Engine, Observation};
use crate::pipeline::{DetectJob, Stage, network::PassTask};

impl Engine {
    /// Queues the detail views of the plan that show the middle of a target.
    pub(super) fn detail_pass(
        &self,
        job: &DetectJob,
        observation: &Observation,
        targets: &[CropTarget],
    ) -> Option<Arc<PassTask>> {
        let details = observation.camera.rig.with_details_of(targets);
        if details.view_count() == 0 {
            return None;
        }
        let (details, model) = (Arc::new(details), Arc::clone(&observation.model));
        let parameters = &job.parameters;
        let camera = parameters.camera_name().filter(|_| parameters.motion);
        let cached_views =
            camera.and_then(|camera| self.motion_cache.of_details(camera, &details, &model));
        job.ticket.timeline.enter(Stage::Queue, Instant::now());
        let frame = Arc::clone(&observation.frame);
        let ticket = job.ticket.clone();
        let task = self
            .inference
            .queue_pass(details, model, frame, ticket, cached_views);
        Some(task)
    }
}

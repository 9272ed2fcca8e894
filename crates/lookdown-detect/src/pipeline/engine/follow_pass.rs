//! The only pass over a frame in which persons are followed: crops where they are expected.

use std::{sync::Arc, time::Instant};

use lookdown_lens::geometry::crop_placement::place_crops;

use super::{Engine, Observation, first_pass::FirstPass};
use crate::pipeline::{DetectJob, Stage, follow::FollowOrigin, pass::Pass};

impl Engine {
    /// Queues crops around followed persons, unless the frame must be searched.
    pub(super) fn follow_pass(&self, job: &DetectJob, observation: &mut Observation) -> FirstPass {
        let parameters = &job.parameters;
        let camera = parameters.camera_name().filter(|_| parameters.follow);
        let Some(camera) = camera.filter(|_| observation.profile.has_crops()) else {
            return FirstPass::Search;
        };
        job.ticket.timeline.enter(Stage::Remap, Instant::now());
        let rig = Arc::clone(&observation.camera.rig);
        let origin = FollowOrigin::new(
            &rig,
            &observation.model,
            parameters.refinement,
            parameters.motion,
        );
        let at = parameters.captured_at.unwrap_or(job.received_at);
        let follow = self
            .follow_cache
            .compare(camera, origin, &observation.frame, at);
        if follow.repeats_search {
            self.motion_cache.forget(camera);
        }
        let targets = follow.targets(&rig);
        observation.follow = Some(follow);
        let Some((targets, most_fill)) = targets else {
            return FirstPass::Search;
        };
        observation.is_searched = false;
        let model = Arc::clone(&observation.model);
        let views = Pass::new(&[], Arc::clone(&rig), model, Vec::new());
        observation.passes.push(views);
        if targets.is_empty() {
            return FirstPass::Nothing;
        }
        let model = self.crop_model(parameters, &observation.model);
        let side = model.input.shorter_side();
        let frame = &observation.network_frame;
        let (width, height) = (frame.width(), frame.height());
        let fill = observation.tuning.crop_fill;
        let tiles = |per_side: u32| {
            // Persons in tiles fill the same share, so that they are smaller with more tiles.
            let fill = (fill * f64::from(per_side.min(2))).min(most_fill);
            place_crops(&targets, targets.len(), fill, side / per_side)
        };
        let crops = self.remappers.install(|| {
            let mut crops = tiles(if targets.len() == 1 { 1 } else { 2 });
            if crops.len() > 4 {
                crops = tiles(3);
            }
            rig.with_crops(side, &crops, width, height)
        });
        if crops.view_count() == 0 {
            return FirstPass::Nothing;
        }
        let task = self.queue_pass(job, observation, Arc::new(crops), model, None);
        FirstPass::Crops(task)
    }

    /// Returns true if the crops of a frame confirm everyone who is followed.
    pub(super) fn confirms_followed(&self, observation: &mut Observation) -> bool {
        let timeline = observation.timeline.clone();
        timeline.enter(Stage::Refine, Instant::now());
        let Some(mut follow) = observation.follow.take() else {
            return false;
        };
        let rig = Arc::clone(&observation.camera.rig);
        let is_confirmed = follow.confirm(&rig, |refinement| self.persons(observation, refinement));
        observation.follow = Some(follow);
        is_confirmed
    }
}

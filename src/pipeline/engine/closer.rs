//! The closer looks that follow the first one.

use std::{sync::Arc, time::Instant};

use super::{Engine, Observation};
use crate::{
    geometry::zoom::zoomed_views,
    pipeline::{DetectJob, Stage, merge, network::LookTask},
};

impl Engine {
    /// Queues closer looks at whatever may be a person, where the profile has them: by the model that
    /// looked first, or half by it and half by another, if the request leaves the choice.
    pub(super) fn closer(&self, job: &DetectJob, observation: &Observation) -> Vec<Arc<LookTask>> {
        let profile = observation.profile;
        let Some(closer) = profile.closer_look() else {
            return Vec::new();
        };
        let timeline = &job.ticket.timeline;
        timeline.enter(Stage::Refine, Instant::now());
        let back_projection = profile.back_projection();
        let outlines = merge::outlines(&observation.looks, back_projection, &closer.first_look);
        timeline.enter(Stage::Remap, Instant::now());
        let mut models = vec![Arc::clone(&observation.model)];
        if job.parameters.model.is_none() {
            let second = self.options.default_models.second_opinion(profile);
            models.extend(second.and_then(|name| self.models.get(name)));
        }
        let most_views = closer.most_views / models.len();
        let rig = &observation.camera.rig;
        let (width, height) = (observation.frame.width(), observation.frame.height());
        let rigs = models.into_iter().filter_map(|model| {
            let size = [model.input().width, model.input().height];
            let mount = &rig.geometry().mount;
            let views = zoomed_views(&outlines, most_views, closer.fill, mount, size);
            let tabulate = || rig.with_views(views, width, height);
            let rig = self.remappers.install(tabulate);
            (rig.view_count() > 0).then_some((rig, model))
        });
        let tasks = rigs.map(|(rig, model)| {
            let frame = Arc::clone(&observation.frame);
            let ticket = job.ticket.clone();
            self.network.look(Arc::new(rig), model, frame, ticket, None)
        });
        let tasks: Vec<_> = tasks.collect();
        if tasks.is_empty() {
            timeline.leave(Instant::now());
        } else {
            timeline.enter(Stage::Queue, Instant::now());
        }
        tasks
    }
}

//! The second pass: zoom views and upright crops around the candidates of the first pass.

use std::{sync::Arc, time::Instant};

use lookdown_lens::geometry::{
    Ray,
    crop_placement::{CropTarget, place_crops},
    zoom::zoomed_views,
};

use super::{Engine, Observation};
use crate::{
    inference::Model,
    pipeline::{
        DetectJob, Stage, camera_rig::CameraRig, merge, motion_cache::CameraViews,
        network::PassTask,
    },
};

/// Views and the model that processes them.
type Planned = (CameraRig, Arc<Model>);

impl Engine {
    /// Queues the second pass over possible persons, if the profile has one.
    pub(super) fn second_pass(
        &self,
        job: &DetectJob,
        observation: &Observation,
    ) -> Vec<Arc<PassTask>> {
        let profile = observation.profile;
        if profile.max_second_pass_views() == 0 {
            return Vec::new();
        }
        let timeline = &job.ticket.timeline;
        timeline.enter(Stage::Refine, Instant::now());
        let targets =
            merge::second_pass_targets(&observation.passes, &observation.camera.rig, profile);
        timeline.enter(Stage::Remap, Instant::now());
        let mut planned = self.zoomed(job, observation, &targets.outlines);
        planned.extend(self.crops(job, observation, &targets.crop_targets));
        let tasks = planned.into_iter().map(|(rig, model)| {
            let rig = Arc::new(rig);
            let cached_views = self.cached_crops(job, &rig, &model);
            let frame = Arc::clone(&observation.frame);
            let ticket = job.ticket.clone();
            self.network
                .queue_pass(rig, model, frame, ticket, cached_views)
        });
        let tasks: Vec<_> = tasks.collect();
        if tasks.is_empty() {
            timeline.leave(Instant::now());
        } else {
            timeline.enter(Stage::Queue, Instant::now());
        }
        tasks
    }

    /// Returns the camera's crops in the motion cache, if the request enables motion detection.
    fn cached_crops(
        &self,
        job: &DetectJob,
        rig: &Arc<CameraRig>,
        model: &Arc<Model>,
    ) -> Option<Arc<CameraViews>> {
        let parameters = &job.parameters;
        let camera = parameters.camera_name().filter(|_| parameters.motion)?;
        let _first = rig.crops().next()?;
        self.motion_cache.of_crops(camera, rig, model)
    }

    /// Plans zoom views for the model of the first pass. If the request names no model and the
    /// profile has a second model, each of the two models gets half of the views.
    fn zoomed(
        &self,
        job: &DetectJob,
        observation: &Observation,
        outlines: &[Vec<Ray>],
    ) -> Vec<Planned> {
        let profile = observation.profile;
        let Some(pass) = profile.zoom_pass() else {
            return Vec::new();
        };
        let mut models = vec![Arc::clone(&observation.model)];
        if job.parameters.model.is_none() {
            let second = self.options.default_models.second_opinion(profile);
            models.extend(second.and_then(|name| self.models.get(name)));
        }
        let most_views = pass.most_views / models.len();
        let rig = &observation.camera.rig;
        let (width, height) = (observation.frame.width(), observation.frame.height());
        let rigs = models.into_iter().filter_map(|model| {
            let size = [model.input().width, model.input().height];
            let mount = &rig.geometry().mount;
            let views = zoomed_views(outlines, most_views, pass.fill, mount, size);
            let tabulate = || rig.with_views(views, width, height);
            let rig = self.remappers.install(tabulate);
            (rig.view_count() > 0).then_some((rig, model))
        });
        rigs.collect()
    }

    /// Plans upright crops of the frame for the profile's model of crops, or for the model that the
    /// request names.
    fn crops(
        &self,
        job: &DetectJob,
        observation: &Observation,
        targets: &[CropTarget],
    ) -> Option<Planned> {
        let profile = observation.profile;
        let pass = profile.crop_pass()?;
        let models = &self.options.default_models;
        let unnamed = job.parameters.model.is_none();
        let own = unnamed.then(|| models.crop_model(profile)).flatten();
        let model = own.and_then(|name| self.models.get(name));
        let model = model.unwrap_or_else(|| Arc::clone(&observation.model));
        let side = model.input().width.min(model.input().height);
        let crops = place_crops(targets, pass.max_crops, pass.fill, side);
        let (width, height) = (observation.frame.width(), observation.frame.height());
        let rig = &observation.camera.rig;
        let rig = self
            .remappers
            .install(|| rig.with_crops(&crops, width, height));
        (rig.view_count() > 0).then_some((rig, model))
    }
}

//! What is known of a frame after the network has seen it.

use std::sync::Arc;

use super::camera::FrameCamera;
use crate::{
    imaging::Frame,
    inference::Model,
    pipeline::{
        PipelineError, Profile, Stage, StageTimings, Timeline, ViewCounts,
        network::{PassTask, Work},
        pass::Pass,
    },
    warning::Warning,
};

/// A frame after the network has seen it: all that refinement needs, so that other refinements
/// of the same frame cost no inference.
pub struct Observation {
    /// The decoded frame, EXIF orientation applied.
    pub frame: Arc<Frame>,
    pub(super) camera: FrameCamera,
    pub(super) model: Arc<Model>,
    pub(super) profile: Profile,
    pub(super) passes: Vec<Pass>,
    pub(super) still_views: usize,
    pub(super) batch_count: usize,
    pub(super) non_finite: usize,
    pub(super) timeline: Timeline,
    pub(super) warnings: Vec<Warning>,
}

impl Observation {
    /// How many views were looked at, now or, where nothing has moved since, before.
    #[must_use]
    pub fn view_count(&self) -> usize {
        self.passes.iter().map(|look| look.rig.view_count()).sum()
    }

    /// What became of the views.
    pub(super) fn view_counts(&self) -> ViewCounts {
        ViewCounts {
            inferred: self.view_count() - self.still_views,
            unchanged: self.still_views,
            outside: self.camera.rig.views_outside(),
            masked: self.camera.rig.views_masked(),
        }
    }

    /// Where the time went so far: `refine` and `total` are still to come.
    #[must_use]
    pub fn timings(&self) -> StageTimings {
        self.timeline.timings()
    }

    /// The model that looked.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Another model that looked as well, if there was anything to look at again.
    pub(super) fn second_model(&self) -> Option<&Model> {
        let mut models = self.passes.iter().map(|look| &*look.model);
        models.find(|model| model.name() != self.model.name())
    }

    /// Waits for rounds that were queued together, and takes in what came of them. Views are
    /// rendered and looked at side by side: the span from the first to the last is divided in the
    /// proportion of the work.
    pub(super) fn take_in(&mut self, tasks: &[Arc<PassTask>]) -> Result<(), PipelineError> {
        let mut work: Option<Work> = None;
        for task in tasks {
            let looked = task.wait()?;
            work = Some(work.map_or(looked.work, |others| others.and(looked.work)));
            self.passes.push(Pass {
                rig: Arc::clone(&task.rig),
                model: Arc::clone(&task.model),
                per_view: looked.per_view,
            });
        }
        let Some(work) = work else { return Ok(()) };
        self.batch_count += work.runs;
        self.still_views += work.still_views;
        self.non_finite += work.non_finite;
        let span = work.ended.saturating_duration_since(work.began);
        let remap = span.mul_f64(work.remap_share());
        self.timeline.enter(Stage::Remap, work.began);
        self.timeline.enter(Stage::Inference, work.began + remap);
        self.timeline.leave(work.ended);
        Ok(())
    }
}

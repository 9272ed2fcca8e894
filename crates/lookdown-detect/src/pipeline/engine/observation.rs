//! The result of inference on a frame.

use std::sync::Arc;

use lookdown_calibration::warning::Warning;

use super::camera::FrameCamera;
use crate::{
    inference::Model,
    parameters::{Profile, Tuning},
    pipeline::{
        PipelineError, Search, Stage, StageTimings, Timeline, ViewCounts, follow::FollowedFrame,
        network::PassTask, pass::Pass,
    },
};
use lookdown_imaging::Frame;

/// A frame with its detections: the complete input of refinement, so that other refinements of the
/// same frame need no inference.
pub struct Observation {
    /// The decoded frame, EXIF orientation applied.
    pub frame: Arc<Frame>,
    /// The frame that views and crops show: in even light if it has no color, else the same.
    pub(super) network_frame: Arc<Frame>,
    pub(super) camera: FrameCamera,
    /// The model of the first pass.
    pub model: Arc<Model>,
    pub(super) profile: Profile,
    pub(super) tuning: Tuning,
    pub(super) passes: Vec<Pass>,
    /// False if persons were followed and the views of the plan were left out.
    pub(super) is_searched: bool,
    /// The persons of the frames before, if the camera's persons are followed.
    pub(super) follow: Option<FollowedFrame>,
    pub(super) unchanged_views: usize,
    pub(super) batch_count: usize,
    pub(super) non_finite: usize,
    pub(super) timeline: Timeline,
    pub(super) warnings: Vec<Warning>,
}

impl Observation {
    /// Returns the number of views with detections, from this frame's inference or from the motion
    /// cache.
    pub fn view_count(&self) -> usize {
        let left_out = usize::from(!self.is_searched);
        let passes = self.passes.iter().skip(left_out);
        passes.map(|pass| pass.rig.view_count()).sum()
    }

    /// Returns the counts of views by outcome.
    pub(super) fn view_counts(&self) -> ViewCounts {
        let left_out = self.camera.rig.left_out;
        ViewCounts {
            inferred: self.view_count() - self.unchanged_views,
            unchanged: self.unchanged_views,
            outside: left_out.outside,
            masked: left_out.masked,
            outside_areas: left_out.outside_areas,
            not_needed: self.details_not_needed(),
        }
    }

    /// Returns the number of detail views of a search that show no possible person.
    fn details_not_needed(&self) -> usize {
        if !self.is_searched {
            return 0;
        }
        let later = self.passes.iter().skip(1);
        let details = later.map(|pass| pass.rig.virtual_views().count());
        self.camera.rig.detail_count() - details.sum::<usize>()
    }

    /// Returns how the persons of the frame were found.
    pub(super) fn search(&self) -> Search {
        let count = self.view_count();
        match (self.is_searched, count > self.unchanged_views) {
            (true, false) if count > 0 => Search::Unchanged,
            (true, _) => Search::Full,
            (false, true) => Search::Followed,
            (false, false) => Search::Unchanged,
        }
    }

    /// Returns the stage timings so far, without `refine` and `total`.
    pub fn timings(&self) -> StageTimings {
        self.timeline.timings()
    }

    /// Returns the model of the upright crops, if it is another one than that of the first pass.
    pub(super) fn crop_model(&self) -> Option<&Model> {
        let crops = self.passes.iter().filter(|pass| pass.is_of_crops());
        let mut models = crops.map(|pass| &*pass.model);
        models.find(|model| model.name != self.model.name)
    }

    /// Waits for a queued pass, and adds its detections. Rendering and inference overlap, so the
    /// span is divided between these stages in proportion to their work.
    pub(super) fn wait_for(&mut self, task: &PassTask) -> Result<(), PipelineError> {
        let output = task.wait()?;
        let cost = output.cost;
        let (rig, model) = (Arc::clone(&task.rig), Arc::clone(&task.model));
        let per_view = task.rig.per_view(output.per_view);
        self.passes
            .push(Pass::new(&self.passes, rig, model, per_view));
        self.batch_count += cost.runs;
        self.unchanged_views += cost.still_views;
        self.non_finite += cost.non_finite;
        let span = cost.ended.saturating_duration_since(cost.began);
        let remap = span.mul_f64(cost.remap_share());
        self.timeline.enter(Stage::Remap, cost.began);
        self.timeline.enter(Stage::Inference, cost.began + remap);
        self.timeline.leave(cost.ended);
        Ok(())
    }
}

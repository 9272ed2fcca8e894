//! The further looks of a search: detail views and crops where persons are possible.

use std::time::Instant;

use lookdown_lens::geometry::crop_placement::CropTarget;

use super::{Engine, Observation};
use crate::pipeline::{DetectJob, PipelineError, Stage, merge};

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
}

impl Observation {
    /// Returns the possible persons in the passes so far, highest score first.
    fn possible_persons(&self) -> Vec<CropTarget> {
        self.timeline.enter(Stage::Refine, Instant::now());
        let (passes, rig) = (&self.passes, &self.camera.rig);
        merge::possible_persons(passes, rig, self.profile, &self.tuning)
    }
}

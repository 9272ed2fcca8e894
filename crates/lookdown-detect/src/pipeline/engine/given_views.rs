//! Inference on views that the client has rendered.

use std::{sync::atomic::Ordering, time::Instant};

use super::Engine;
use crate::{
    imaging::ViewBatch,
    inference::HeadOutput,
    pipeline::{ClientViewsJob, PipelineError, Stage, error::of_inference},
};

impl Engine {
    /// Detects persons in views without further processing, in batches of the usual size. Blocks:
    /// it waits for a session, as the inference threads do.
    ///
    /// # Errors
    /// Returns a [`PipelineError`], which distinguishes client and server faults.
    pub fn infer_views(&self, job: &ClientViewsJob) -> Result<HeadOutput, PipelineError> {
        let input = job.model.input();
        let views = job.model.batch_of(self.options.batches.max_views).get();
        let session = self.next_session.fetch_add(1, Ordering::Relaxed);
        let mut batch = ViewBatch::default();
        let mut found = HeadOutput::default();
        for pixels in (*job.pixels).as_ref().chunks(views * input.view_len()) {
            if job.ticket.withdrawn.is_cancelled() {
                return Err(PipelineError::Withdrawn);
            }
            job.ticket.timeline.enter(Stage::Inference, Instant::now());
            let slots = batch.prepare(pixels.len() / input.view_len(), input);
            for (slot, view) in slots.zip(pixels.chunks_exact(input.view_len())) {
                input.fill(slot, view);
            }
            let output = job.model.detect(session, &batch);
            let output = output.map_err(|error| of_inference(&error))?;
            found.non_finite += output.non_finite;
            found.per_view.extend(output.per_view);
        }
        job.ticket.timeline.leave(Instant::now());
        Ok(found)
    }
}

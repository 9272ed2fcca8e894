//! The inference threads. Each thread takes the next views of any frame, renders them and runs its
//! session of their model on them.
//!
//! A thread renders a single view itself: the pixels are still in its CPU cache when the network
//! reads them, and no core waits for another. Only batches of several views are rendered in
//! parallel by the thread pool.

mod batch_cost;
mod batch_options;
mod claim;
mod pass_task;
mod run;
mod view_queue;

use std::{
    num::NonZeroUsize,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
    thread::JoinHandle,
};

use rayon::ThreadPool;

pub use self::batch_options::BatchOptions;
use self::{claim::Claim, view_queue::ViewQueue};
use super::{
    Ticket,
    camera_rig::CameraRig,
    error::{PipelineError, from_inference, internal},
    motion_cache::CameraViews,
};
use crate::{inference::Model, metrics::DetectMetrics};
use lookdown_imaging::{Frame, ViewBatch};

pub(super) use batch_cost::BatchCost;
pub(super) use pass_task::PassTask;

/// The inference threads and their queue. Dropping it ends the threads after the queued views are
/// processed.
pub(super) struct InferenceThreads {
    queue: Arc<ViewQueue>,
    threads: Vec<JoinHandle<()>>,
}

impl InferenceThreads {
    /// Starts one thread per session of the models.
    pub(super) fn start(
        sessions: NonZeroUsize,
        options: BatchOptions,
        remappers: &Arc<ThreadPool>,
        metrics: &Arc<DetectMetrics>,
    ) -> std::io::Result<Self> {
        let mut inference = Self {
            queue: Arc::new(ViewQueue::new(options)),
            threads: Vec::with_capacity(sessions.get()),
        };
        for session in 0..sessions.get() {
            let (queue, remappers) = (Arc::clone(&inference.queue), Arc::clone(remappers));
            let metrics = Arc::clone(metrics);
            let thread = std::thread::Builder::new()
                .name(format!("network-{session}"))
                .spawn(move || serve(&queue, session, &remappers, &metrics))?;
            inference.threads.push(thread);
        }
        Ok(inference)
    }

    /// Queues the views of a rig. [`PassTask::wait`] returns their detections. Views without motion
    /// according to `seen_before` skip the network.
    pub(super) fn queue_pass(
        &self,
        rig: Arc<CameraRig>,
        model: Arc<Model>,
        frame: Arc<Frame>,
        ticket: Ticket,
        seen_before: Option<Arc<CameraViews>>,
    ) -> Arc<PassTask> {
        let task = Arc::new(PassTask::new(rig, model, frame, ticket, seen_before));
        self.queue.submit(Arc::clone(&task));
        task
    }
}

impl Drop for InferenceThreads {
    fn drop(&mut self) {
        self.queue.close();
        for thread in self.threads.drain(..) {
            // A thread that panicked has already failed the tasks of its batch.
            let _ = thread.join();
        }
    }
}

/// Processes batches on an inference thread until the queue is closed.
fn serve(queue: &ViewQueue, session: usize, remappers: &ThreadPool, metrics: &DetectMetrics) {
    let mut batch = ViewBatch::default();
    while let Some(claims) = queue.next_batch() {
        record(metrics, &claims);
        // Log lines of a shared batch are attributed to the frame of the first claim.
        let _in_request = claims[0].task.request.enter();
        let run = || run::execute(&claims, session, remappers, &mut batch);
        match catch_unwind(AssertUnwindSafe(run)) {
            Ok(Ok(run)) => run.dispatch(&claims),
            Ok(Err(error)) => fail(&claims, || from_inference(&error)),
            Err(_) => fail(&claims, || {
                internal(anyhow::anyhow!("the network's thread panicked on a batch"))
            }),
        }
    }
}

/// Records the size of a batch that starts now, and how long its first view has waited.
fn record(metrics: &DetectMetrics, claims: &[Claim]) {
    let views: usize = claims.iter().map(|claim| claim.views.len()).sum();
    let waits = claims.iter().map(|claim| claim.task.queued.elapsed());
    let wait = waits.max().unwrap_or_default();
    let no_labels: [&str; 0] = [];
    let (size, waited) = (&metrics.batch_size, &metrics.batch_wait);
    size.with_label_values(&no_labels).observe(views as f64);
    waited
        .with_label_values(&no_labels)
        .observe(wait.as_secs_f64());
}

fn fail(claims: &[Claim], error: impl Fn() -> PipelineError) {
    for claim in claims {
        claim.task.fail(error());
    }
}

#[cfg(test)]
mod tests;

//! The network's threads: each takes the views that are next, of whichever frames, renders them
//! and runs its session of their model on them.
//!
//! A thread renders what it is about to look at itself: the pixels are still in its cache when the
//! network reads them, and no core waits for another. Only batches of several views are rendered
//! by the pool, side by side.

mod pass_task;
mod run;
mod view_queue;
mod work;

use std::{
    num::NonZeroUsize,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
    thread::JoinHandle,
    time::Duration,
};

use rayon::ThreadPool;

use self::view_queue::ViewQueue;
use super::{
    Ticket,
    camera_rig::CameraRig,
    error::{PipelineError, internal, of_inference},
    motion_cache::CameraViews,
};
use crate::{
    imaging::{Frame, ViewBatch},
    inference::Model,
};

pub(super) use pass_task::PassTask;
pub(super) use work::Work;

/// Views of one round of looking that a thread has taken on.
struct Claim {
    task: Arc<PassTask>,
    views: std::ops::Range<usize>,
}

/// How views become batches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BatchOptions {
    /// Most views in one run of the network.
    pub max_views: NonZeroUsize,
    /// How long the first view of a batch may wait for others to fill it.
    pub max_delay: Duration,
}

/// The network's threads and the queue that they serve. Dropping it ends them after the views
/// that are waiting.
pub(super) struct Network {
    queue: Arc<ViewQueue>,
    threads: Vec<JoinHandle<()>>,
}

impl Network {
    /// Starts a thread for each session that models have.
    pub(super) fn start(
        sessions: NonZeroUsize,
        options: BatchOptions,
        remappers: &Arc<ThreadPool>,
    ) -> std::io::Result<Self> {
        let mut network = Self {
            queue: Arc::new(ViewQueue::new(options)),
            threads: Vec::with_capacity(sessions.get()),
        };
        for session in 0..sessions.get() {
            let (queue, remappers) = (Arc::clone(&network.queue), Arc::clone(remappers));
            let thread = std::thread::Builder::new()
                .name(format!("network-{session}"))
                .spawn(move || serve(&queue, session, &remappers))?;
            network.threads.push(thread);
        }
        Ok(network)
    }

    /// Queues the views of a rig; [`PassTask::wait`] gives what was found in them. Views that
    /// `seen_before` says nothing has moved in are not looked at.
    pub(super) fn look(
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

impl Drop for Network {
    fn drop(&mut self) {
        self.queue.close();
        for thread in self.threads.drain(..) {
            // A thread that panicked has told the frames it was working on.
            let _ = thread.join();
        }
    }
}

/// What a thread does until the queue is closed.
fn serve(queue: &ViewQueue, session: usize, remappers: &ThreadPool) {
    let mut batch = ViewBatch::default();
    while let Some(claims) = queue.next_batch() {
        // As with all that cannot be divided: it belongs to the frame whose view was next.
        let _in_request = claims[0].task.request.enter();
        let look = || run::look(&claims, session, remappers, &mut batch);
        match catch_unwind(AssertUnwindSafe(look)) {
            Ok(Ok(run)) => run.hand_out(&claims),
            Ok(Err(error)) => fail(&claims, || of_inference(&error)),
            Err(_) => fail(&claims, || {
                internal(anyhow::anyhow!("the network's thread panicked on a batch"))
            }),
        }
    }
}

fn fail(claims: &[Claim], error: impl Fn() -> PipelineError) {
    for claim in claims {
        claim.task.fail(error());
    }
}

#[cfg(test)]
mod tests;

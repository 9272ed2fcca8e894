//! The network's threads: each takes the views that are next, of whichever frames, renders them
//! and runs its session of their model on them.
//!
//! A thread renders what it is about to look at itself: the pixels are still in its cache when the
//! network reads them, and no core waits for another. Only batches of several views are rendered
//! by the pool, side by side.

mod look_task;
mod view_queue;
mod work;

use std::{
    num::NonZeroUsize,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
    thread::JoinHandle,
    time::{Duration, Instant},
};

use rayon::{ThreadPool, prelude::*};

use self::view_queue::ViewQueue;
use super::{
    Ticket,
    camera_rig::CameraRig,
    error::{PipelineError, internal},
};
use crate::{
    imaging::{Frame, ViewBatch},
    inference::{HeadOutput, Model},
};

pub(super) use look_task::LookTask;
pub(super) use work::Work;

/// Views of one round of looking that a thread has taken on.
struct Claim {
    task: Arc<LookTask>,
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

    /// Queues the views of a rig; [`LookTask::wait`] gives what was found in them.
    pub(super) fn look(
        &self,
        rig: Arc<CameraRig>,
        model: Arc<Model>,
        frame: Arc<Frame>,
        ticket: Ticket,
    ) -> Arc<LookTask> {
        let task = Arc::new(LookTask::new(rig, model, frame, ticket));
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
        let run = || run(&claims, session, remappers, &mut batch);
        match catch_unwind(AssertUnwindSafe(run)) {
            Ok(Ok(run)) => run.hand_out(&claims),
            Ok(Err(error)) => fail(&claims, || internal(anyhow::anyhow!("{error:#}"))),
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

/// One run of the network.
struct Run {
    output: HeadOutput,
    began: Instant,
    rendered: Instant,
    ended: Instant,
}

fn run(
    claims: &[Claim],
    session: usize,
    remappers: &ThreadPool,
    batch: &mut ViewBatch,
) -> anyhow::Result<Run> {
    let began = Instant::now();
    let model = &claims[0].task.model;
    let views: Vec<(&LookTask, usize)> = claims
        .iter()
        .flat_map(|claim| claim.views.clone().map(|view| (&*claim.task, view)))
        .collect();
    let slots = batch.prepare(views.len(), model.input());
    let render = |((task, view), slot): ((&LookTask, usize), &mut [f32])| {
        task.rig.render_view(view, &task.frame, model.input(), slot);
    };
    let mut jobs: Vec<_> = views.into_iter().zip(slots).collect();
    match jobs.pop() {
        Some(only) if jobs.is_empty() => render(only),
        last => remappers.install(|| {
            jobs.into_par_iter().chain(last).for_each(render);
        }),
    }
    let rendered = Instant::now();
    let output = model.detect(session, batch)?;
    Ok(Run {
        output,
        began,
        rendered,
        ended: Instant::now(),
    })
}

impl Run {
    /// Gives each frame what was found in its views, and its share of the time.
    fn hand_out(self, claims: &[Claim]) {
        let total: usize = claims.iter().map(|claim| claim.views.len()).sum();
        let mut found = self.output.per_view.into_iter();
        let mut non_finite = self.output.non_finite;
        for (index, claim) in claims.iter().enumerate() {
            let views = claim.views.len();
            #[expect(clippy::cast_precision_loss, reason = "far below 2^52 views")]
            let share = views as f64 / total as f64;
            let work = Work {
                queued: claim.task.queued,
                began: self.began,
                ended: self.ended,
                remap: (self.rendered - self.began).mul_f64(share),
                inference: (self.ended - self.rendered).mul_f64(share),
                runs: usize::from(index == 0),
                non_finite: std::mem::take(&mut non_finite),
            };
            let found = found.by_ref().take(views);
            claim.task.finish(claim.views.clone(), found, work);
        }
    }
}

#[cfg(test)]
mod tests;

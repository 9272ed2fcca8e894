//! Worker threads that take frames from a bounded queue.

use std::{
    num::NonZeroUsize,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    thread::JoinHandle,
    time::Instant,
};

use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot};
use tokio_util::sync::CancellationToken;

use super::{
    DetectJob, Detected, Engine, PipelineError, Stage, Ticket, ViewsJob, error::internal,
    frame_queue::FrameQueue, service_rate::ServiceRate,
};
use crate::inference::HeadOutput;

/// Does all the work on a frame, with the way back to whoever waits for it.
type Work = Box<dyn FnOnce(&Engine) -> Done + Send>;

/// What came of a frame.
struct Done {
    withdrawn: bool,
    /// Hands it to whoever waits for it, which takes no time.
    deliver: Box<dyn FnOnce() + Send>,
}

/// A frame in the queue.
struct Entry {
    ticket: Ticket,
    work: Work,
    /// Whose log lines are those of the work.
    request: tracing::Span,
    /// Travels with the work: a place is free again when the work has ended, not when its client
    /// has left.
    place: OwnedSemaphorePermit,
}

/// Named threads that run the engine on a bounded number of frames.
pub struct WorkerPool {
    shared: Arc<Shared>,
    threads: Mutex<Vec<JoinHandle<()>>>,
}

struct Shared {
    engine: Arc<Engine>,
    queue: FrameQueue<Entry>,
    places: Arc<Semaphore>,
    capacity: NonZeroUsize,
    rate: Mutex<ServiceRate>,
    withdrawn: AtomicU64,
}

impl WorkerPool {
    /// Starts `workers` threads; `capacity` frames may wait or be worked on.
    ///
    /// # Errors
    /// When the operating system gives no thread.
    pub fn start(
        engine: &Arc<Engine>,
        workers: NonZeroUsize,
        capacity: NonZeroUsize,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            engine: Arc::clone(engine),
            queue: FrameQueue::new(),
            places: Arc::new(Semaphore::new(capacity.get())),
            capacity,
            rate: Mutex::default(),
            withdrawn: AtomicU64::new(0),
        });
        let threads = (0..workers.get()).map(|index| {
            let shared = Arc::clone(&shared);
            std::thread::Builder::new()
                .name(format!("frame-worker-{index}"))
                .spawn(move || shared.work())
        });
        Ok(Self {
            threads: Mutex::new(threads.collect::<Result<_, _>>()?),
            shared,
        })
    }

    /// The engine that works.
    #[must_use]
    pub fn engine(&self) -> &Engine {
        &self.shared.engine
    }

    /// Queues a frame and waits for its report. Dropping the future withdraws the frame: whatever
    /// of it no thread has begun is never done.
    ///
    /// # Errors
    /// [`PipelineError::Overloaded`] at once when the queue is full,
    /// [`PipelineError::ShuttingDown`] after [`WorkerPool::shut_down`], otherwise what the engine
    /// says.
    pub async fn detect(&self, job: DetectJob) -> Result<Detected, PipelineError> {
        self.detect_and(job, |detected| detected).await
    }

    /// The same, and `finish` is done with what was detected on the thread that worked on the frame,
    /// before its place is free: what takes time, such as drawing, is bounded like the rest.
    ///
    /// # Errors
    /// As [`WorkerPool::detect`].
    pub async fn detect_and<T: Send + 'static>(
        &self,
        job: DetectJob,
        finish: impl FnOnce(Detected) -> T + Send + 'static,
    ) -> Result<T, PipelineError> {
        let ticket = job.ticket.clone();
        ticket.timeline.enter(Stage::Queue, job.arrived);
        let work = move |engine: &Engine| engine.detect(&job).map(finish);
        self.queue(ticket, work).await
    }

    /// Queues views that somebody has made, and waits for what is found in them; otherwise as
    /// [`WorkerPool::detect_and`].
    ///
    /// # Errors
    /// As [`WorkerPool::detect`].
    pub async fn infer_and<T: Send + 'static>(
        &self,
        job: ViewsJob,
        finish: impl FnOnce(HeadOutput) -> T + Send + 'static,
    ) -> Result<T, PipelineError> {
        let ticket = job.ticket.clone();
        ticket.timeline.enter(Stage::Queue, job.arrived);
        let work = move |engine: &Engine| engine.look(&job).map(finish);
        self.queue(ticket, work).await
    }

    /// Does other work that takes its time, such as drawing, in a place among the frames and in the middle of
    /// their priorities: it is bounded as they are. Dropping the future withdraws what has not begun, and
    /// cancels the token that the work is given, so that long work can stop.
    ///
    /// # Errors
    /// As [`WorkerPool::detect`].
    pub async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce(&CancellationToken) -> T + Send + 'static,
    ) -> Result<T, PipelineError> {
        let ticket = Ticket::default();
        let withdrawn = ticket.withdrawn.clone();
        self.queue(ticket, move |_: &Engine| Ok(work(&withdrawn)))
            .await
    }

    async fn queue<T: Send + 'static>(
        &self,
        ticket: Ticket,
        work: impl FnOnce(&Engine) -> Result<T, PipelineError> + Send + 'static,
    ) -> Result<T, PipelineError> {
        let places = Arc::clone(&self.shared.places);
        let Ok(place) = places.try_acquire_owned() else {
            return Err(self.overloaded());
        };
        let _withdrawal = ticket.withdrawn.clone().drop_guard();
        let (answer, waiting) = oneshot::channel();
        self.shared.rate().began(Instant::now());
        let priority = ticket.priority;
        let entry = Entry {
            ticket,
            work: Box::new(|engine| {
                let outcome = catch_unwind(AssertUnwindSafe(|| work(engine)));
                let panicked = || internal(anyhow::anyhow!("a worker panicked on a frame"));
                let outcome = outcome.unwrap_or_else(|_| Err(panicked()));
                Done {
                    withdrawn: matches!(outcome, Err(PipelineError::Withdrawn)),
                    // The client may have left meanwhile.
                    deliver: Box::new(|| drop(answer.send(outcome))),
                }
            }),
            request: tracing::Span::current(),
            place,
        };
        let queued = self.shared.queue.push(priority, entry);
        queued.map_err(|_| PipelineError::ShuttingDown)?;
        // Nothing is delivered of what was withdrawn, for which nobody waits.
        waiting.await.unwrap_or(Err(PipelineError::Withdrawn))
    }

    /// Why a frame would be refused now, if it would: known before its bytes are read.
    ///
    /// # Errors
    /// [`PipelineError::Overloaded`] when the queue is full.
    pub fn admits(&self) -> Result<(), PipelineError> {
        if self.shared.places.available_permits() == 0 {
            return Err(self.overloaded());
        }
        Ok(())
    }

    /// How many frames wait or are worked on.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.shared.pending()
    }

    /// How many frames were given up since the start because nobody waited for them any more.
    #[must_use]
    pub fn withdrawn(&self) -> u64 {
        self.shared.withdrawn.load(Ordering::Relaxed)
    }

    /// Takes no more frames, finishes those in the queue and ends the threads. Blocks.
    pub fn shut_down(&self) {
        self.shared.queue.close();
        let mut threads = self.threads.lock().unwrap_or_else(PoisonError::into_inner);
        for thread in threads.drain(..) {
            // A worker that panicked outside a job has nothing left to tell.
            let _ = thread.join();
        }
    }

    fn overloaded(&self) -> PipelineError {
        PipelineError::Overloaded {
            capacity: self.shared.capacity.get(),
            retry_after: self.shared.rate().time_for(self.pending()),
        }
    }
}

impl Shared {
    /// What a worker does until the queue is closed and empty.
    fn work(&self) {
        while let Some(entry) = self.queue.pop() {
            let Entry {
                ticket,
                work,
                request,
                place,
            } = entry;
            let _in_request = request.enter();
            if ticket.withdrawn.is_cancelled() {
                self.withdrawn.fetch_add(1, Ordering::Relaxed);
                drop((work, place));
                self.rate().given_up(self.pending());
                continue;
            }
            let done = work(&self.engine);
            // Whoever sends the next frame on this answer must find the place free.
            drop(place);
            self.rate().ended(Instant::now(), self.pending());
            if done.withdrawn {
                self.withdrawn.fetch_add(1, Ordering::Relaxed);
            }
            (done.deliver)();
        }
    }

    fn pending(&self) -> usize {
        self.capacity.get() - self.places.available_permits()
    }

    fn rate(&self) -> MutexGuard<'_, ServiceRate> {
        // Numbers only: nothing can be left half changed.
        self.rate.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests;

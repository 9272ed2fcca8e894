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

/// The whole work on a frame, including the channel that returns the result to the caller.
type Work = Box<dyn FnOnce(&Engine) -> Done + Send>;

/// The outcome of a frame.
struct Done {
    withdrawn: bool,
    /// Delivers the outcome to the caller without blocking.
    deliver: Box<dyn FnOnce() + Send>,
}

/// A frame in the queue.
struct Entry {
    ticket: Ticket,
    work: Work,
    /// The tracing span to which the log lines of the work belong.
    request: tracing::Span,
    /// The permit, held until the work has ended, even when its client has disconnected.
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
    /// Starts `workers` threads. At most `capacity` frames may be queued or in progress.
    ///
    /// # Errors
    /// An I/O error when the operating system cannot start a thread.
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

    /// Returns the engine that processes the frames.
    #[must_use]
    pub fn engine(&self) -> &Engine {
        &self.shared.engine
    }

    /// Queues a frame and waits for its report. Dropping the future withdraws the frame: work that
    /// has not begun is skipped.
    ///
    /// # Errors
    /// [`PipelineError::Overloaded`] at once when the queue is full,
    /// [`PipelineError::ShuttingDown`] after [`WorkerPool::shut_down`], otherwise the error of the
    /// engine.
    pub async fn detect(&self, job: DetectJob) -> Result<Detected, PipelineError> {
        self.detect_and(job, |detected| detected).await
    }

    /// Detects like [`WorkerPool::detect`], then calls `finish` with the result on the worker
    /// thread, before the permit is released. Slow work such as drawing is thus bounded as well.
    ///
    /// # Errors
    /// The same as [`WorkerPool::detect`].
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

    /// Queues views rendered by the client and waits for their detections. Otherwise the same as
    /// [`WorkerPool::detect_and`].
    ///
    /// # Errors
    /// The same as [`WorkerPool::detect`].
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

    /// Runs other slow work, such as drawing, at normal priority. It takes a permit like a frame,
    /// so its amount is bounded. Dropping the future withdraws work that has not begun, and cancels
    /// the token passed to the work so that long work can stop.
    ///
    /// # Errors
    /// The same as [`WorkerPool::detect`].
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
        let entry = Entry {
            ticket: ticket.clone(),
            work: Box::new(|engine| {
                let outcome = catch_unwind(AssertUnwindSafe(|| work(engine)));
                let panicked = || internal(anyhow::anyhow!("a worker panicked on a frame"));
                let outcome = outcome.unwrap_or_else(|_| Err(panicked()));
                Done {
                    withdrawn: matches!(outcome, Err(PipelineError::Withdrawn)),
                    // The client may have disconnected.
                    deliver: Box::new(|| drop(answer.send(outcome))),
                }
            }),
            request: tracing::Span::current(),
            place,
        };
        let queued = self.shared.queue.push(&ticket, 1, entry);
        queued.map_err(|_| PipelineError::ShuttingDown)?;
        // The sender of a withdrawn frame is dropped without an answer.
        waiting.await.unwrap_or(Err(PipelineError::Withdrawn))
    }

    /// Checks whether the queue has a free permit, so that a request can be refused before its body
    /// is read.
    ///
    /// # Errors
    /// [`PipelineError::Overloaded`] when the queue is full.
    pub fn admits(&self) -> Result<(), PipelineError> {
        if self.shared.places.available_permits() == 0 {
            return Err(self.overloaded());
        }
        Ok(())
    }

    /// Returns the number of frames queued or in progress.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.shared.pending()
    }

    /// Returns the number of frames withdrawn since the start because their client disconnected.
    #[must_use]
    pub fn withdrawn(&self) -> u64 {
        self.shared.withdrawn.load(Ordering::Relaxed)
    }

    /// Refuses new frames, finishes the queued frames and ends the threads. Blocks.
    pub fn shut_down(&self) {
        self.shared.queue.close();
        let mut threads = self.threads.lock().unwrap_or_else(PoisonError::into_inner);
        for thread in threads.drain(..) {
            // A panic of a worker outside a job needs no further report.
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
    /// Processes frames on a worker thread until the queue is closed and empty.
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
            // A client that sends the next frame after this answer must find the permit free.
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
        // The rate holds plain numbers only, so a panic cannot leave it inconsistent.
        self.rate.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests;

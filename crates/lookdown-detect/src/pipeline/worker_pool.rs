//! Worker threads that take frames from a bounded queue. A frame without a free permit is refused
//! here.

use std::{
    num::NonZeroUsize,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
    thread::JoinHandle,
    time::{Duration, Instant},
};

use parking_lot::Mutex;
use tokio::sync::oneshot;
use tokio_util::sync::CancellationToken;

use super::{
    DetectJob, DetectedFrame, Engine, PipelineError, Stage, Stall, Ticket,
    error::internal,
    frame_cost,
    frame_queue::FrameQueue,
    in_flight::{InFlight, InFlightGuard},
    service_rate::ServiceRate,
};
use crate::{
    fairness::{BudgetError, Client, SharedBudget},
    metrics::DetectMetrics,
};

/// The whole work on a frame, including the channel that returns the result to the caller.
type QueuedJob = Box<dyn FnOnce(&Engine) -> Done + Send>;

/// The outcome of a frame.
struct Done {
    withdrawn: bool,
    /// Delivers the outcome to the caller without blocking.
    deliver: Box<dyn FnOnce() + Send>,
}

/// A frame in the queue.
struct Entry {
    ticket: Ticket,
    job: QueuedJob,
    /// The tracing span to which the log lines of the work belong.
    request: tracing::Span,
    /// The permits, held until the work has ended, even when its client has disconnected.
    guard: InFlightGuard,
}

/// Named threads that run the engine on a bounded number of frames.
pub struct WorkerPool {
    shared: Arc<Shared>,
    threads: Mutex<Vec<JoinHandle<()>>>,
}

struct Shared {
    engine: Arc<Engine>,
    queue: FrameQueue<Entry>,
    budget: SharedBudget,
    in_flight: Arc<InFlight>,
    // The rate holds plain numbers only, so a panic cannot leave it inconsistent.
    rate: Mutex<ServiceRate>,
    metrics: Arc<DetectMetrics>,
}

impl WorkerPool {
    /// Starts `workers` threads. At most `capacity` frames of a usual size may be queued or in
    /// progress, and half of them may be of one client. Larger frames cost more permits.
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
            budget: SharedBudget::new(capacity.get()),
            in_flight: Arc::default(),
            rate: Mutex::default(),
            metrics: Arc::clone(&engine.metrics),
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
    pub fn engine(&self) -> &Engine {
        &self.shared.engine
    }

    /// Queues a frame, waits for its report, and calls `finish` with the result on the worker
    /// thread, before the permit is released. Slow work such as drawing is thus bounded as well.
    /// Dropping the future withdraws the frame: work that has not begun is skipped.
    ///
    /// # Errors
    /// [`PipelineError::Overloaded`] at once when the queue is full, [`PipelineError::ShareUsed`]
    /// when the client has too many frames in it, [`PipelineError::ShuttingDown`] after
    /// [`WorkerPool::shut_down`], otherwise the error of the engine.
    pub async fn detect_and<T: Send + 'static>(
        &self,
        job: DetectJob,
        finish: impl FnOnce(DetectedFrame) -> T + Send + 'static,
    ) -> Result<T, PipelineError> {
        let ticket = job.ticket.clone();
        ticket.timeline.enter(Stage::Queue, job.arrived);
        let cost = frame_cost::for_frame(&job, self.engine().options.decode_limits.max_pixels);
        let work = move |engine: &Engine| engine.detect(&job).map(finish);
        self.queue(ticket, cost, work).await
    }

    /// Runs other slow work, such as drawing. It takes a permit like a frame, so its amount is
    /// bounded. Dropping the future withdraws work that has not begun, and cancels
    /// the token passed to the work so that long work can stop.
    ///
    /// # Errors
    /// The same as [`WorkerPool::detect_and`].
    pub async fn run<T: Send + 'static>(
        &self,
        ticket: Ticket,
        work: impl FnOnce(&CancellationToken) -> T + Send + 'static,
    ) -> Result<T, PipelineError> {
        let withdrawn = ticket.withdrawn.clone();
        self.queue(ticket, 1, move |_: &Engine| Ok(work(&withdrawn)))
            .await
    }

    async fn queue<T: Send + 'static>(
        &self,
        ticket: Ticket,
        cost: usize,
        work: impl FnOnce(&Engine) -> Result<T, PipelineError> + Send + 'static,
    ) -> Result<T, PipelineError> {
        let cost = cost.min(self.shared.budget.share());
        let permits = self.shared.budget.take(&ticket.client, cost);
        let permits = permits.map_err(|error| self.refusal(error, &ticket.client))?;
        let guard = self.shared.in_flight.add(&ticket, permits, Instant::now());
        let _withdrawal = ticket.withdrawn.clone().drop_guard();
        let (answer, waiting) = oneshot::channel();
        self.shared.rate.lock().began(Instant::now());
        let entry = Entry {
            ticket: ticket.clone(),
            job: Box::new(|engine| {
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
            guard,
        };
        let queued = self.shared.queue.push(&ticket, cost, entry);
        queued.map_err(|_| PipelineError::ShuttingDown)?;
        // The sender of a withdrawn frame is dropped without an answer.
        waiting.await.unwrap_or(Err(PipelineError::Withdrawn))
    }

    /// Checks whether the queue has a free permit for a client, so that a request can be refused
    /// before its body is read.
    ///
    /// # Errors
    /// [`PipelineError::Overloaded`] when the queue is full, [`PipelineError::ShareUsed`] when the
    /// client has too many frames in it.
    pub fn admits(&self, client: &Client) -> Result<(), PipelineError> {
        let checked = self.shared.budget.check(client, 1);
        checked.map_err(|error| self.refusal(error, client))
    }

    /// Returns the number of frames queued or in progress.
    pub fn pending(&self) -> usize {
        self.shared.in_flight.count()
    }

    /// Returns the stall of the pool: there is work, and for at least `limit` none has progressed.
    pub fn stall(&self, now: Instant, limit: Duration) -> Option<Stall> {
        self.shared.in_flight.stall(now, limit)
    }

    /// Returns a stall like [`WorkerPool::stall`], but each only once, for the log.
    pub fn new_stall(&self, now: Instant, limit: Duration) -> Option<Stall> {
        let stall = self.shared.in_flight.new_stall(now, limit)?;
        self.shared.metrics.worker_stalls.inc();
        Some(stall)
    }

    /// Returns the time since the last progress. Zero without work.
    pub fn quiet_for(&self, now: Instant) -> Duration {
        self.shared.in_flight.quiet_for(now)
    }

    /// Refuses new frames, finishes the queued frames and ends the threads. Blocks.
    pub fn shut_down(&self) {
        self.shared.queue.close();
        let mut threads = self.threads.lock();
        for thread in threads.drain(..) {
            // A panic of a worker outside a job needs no further report.
            let _ = thread.join();
        }
    }

    fn refusal(&self, error: BudgetError, client: &Client) -> PipelineError {
        let capacity = self.shared.budget.total();
        let retry_after = self.shared.rate.lock().time_for(self.pending());
        match error {
            BudgetError::Full => PipelineError::Overloaded {
                capacity,
                retry_after,
            },
            BudgetError::ShareUsed { share } => PipelineError::ShareUsed {
                client: client.clone(),
                share,
                capacity,
                retry_after,
            },
        }
    }
}

impl Shared {
    /// Processes frames on a worker thread until the queue is closed and empty.
    fn work(&self) {
        while let Some(entry) = self.queue.pop() {
            let Entry {
                ticket,
                job,
                request,
                guard,
            } = entry;
            let _in_request = request.enter();
            if ticket.withdrawn.is_cancelled() {
                self.metrics.withdrawn_frames.inc();
                drop(job);
                guard.end(Instant::now());
                self.rate.lock().given_up(self.in_flight.count());
                continue;
            }
            guard.begin(Instant::now());
            let done = job(&self.engine);
            // A client that sends the next frame after this answer must find the permit free.
            guard.end(Instant::now());
            self.rate
                .lock()
                .ended(Instant::now(), self.in_flight.count());
            if done.withdrawn {
                self.metrics.withdrawn_frames.inc();
            }
            (done.deliver)();
        }
    }
}

#[cfg(test)]
mod tests;

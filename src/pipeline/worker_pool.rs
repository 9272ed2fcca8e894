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

use super::{
    DetectJob, Detected, Engine, PipelineError, Stage, error::internal, frame_queue::FrameQueue,
    service_rate::ServiceRate,
};

/// Hands what came of a frame to whoever waits for it.
type Delivery = Box<dyn FnOnce() + Send>;
/// Finishes what came of a frame, which takes its time, and tells how to deliver it, which takes none.
type Finish = Box<dyn FnOnce(Result<Detected, PipelineError>) -> Delivery + Send>;

/// A frame in the queue with the way back to whoever waits for it.
struct Entry {
    job: DetectJob,
    finish: Finish,
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
        let places = Arc::clone(&self.shared.places);
        let Ok(place) = places.try_acquire_owned() else {
            return Err(self.overloaded());
        };
        let _withdrawal = job.ticket.withdrawn.clone().drop_guard();
        let (answer, waiting) = oneshot::channel();
        self.shared.rate().began(Instant::now());
        let priority = job.ticket.priority;
        job.ticket.timeline.enter(Stage::Queue, job.arrived);
        let entry = Entry {
            job,
            finish: Box::new(|outcome| {
                let finished = outcome.map(finish);
                // The client may have left meanwhile.
                Box::new(|| drop(answer.send(finished)))
            }),
            request: tracing::Span::current(),
            place,
        };
        let queued = self.shared.queue.push(priority, entry);
        queued.map_err(|_| PipelineError::ShuttingDown)?;
        waiting
            .await
            .unwrap_or_else(|_| Err(internal(anyhow::anyhow!("a worker panicked on a frame"))))
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
                job,
                finish,
                request,
                place,
            } = entry;
            let _in_request = request.enter();
            if job.ticket.withdrawn.is_cancelled() {
                self.withdrawn.fetch_add(1, Ordering::Relaxed);
                drop((job, place));
                self.rate().given_up(self.pending());
                continue;
            }
            let delivery = catch_unwind(AssertUnwindSafe(|| {
                let outcome = self.engine.detect(&job);
                if matches!(outcome, Err(PipelineError::Withdrawn)) {
                    self.withdrawn.fetch_add(1, Ordering::Relaxed);
                }
                finish(outcome)
            }));
            // Whoever sends the next frame on this answer must find the place free.
            drop((job, place));
            self.rate().ended(Instant::now(), self.pending());
            // After a panic nothing is delivered, which tells whoever waits.
            if let Ok(deliver) = delivery {
                deliver();
            }
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
